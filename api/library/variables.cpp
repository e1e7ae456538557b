// The calls of a Client about variables of applications, but for their watch.
#include "api/library/variables.hpp"

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "api/client/client_core_status.hpp"
#include "api/dds/page_sample.hpp"
#include "api/dds/text.hpp"
#include "api/library/calls.hpp"
#include "api/library/convert.hpp"
#include "api/library/worker.hpp"
#include "api/recording/variable_recording.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

using Variables = std::vector<Client::Variable>;
using Forces = std::vector<Client::Force>;

// The timeout is that of one page.
Async<Result<Variables>> read_all(CallOrder& order, ClientCore& core, std::string host, std::string instance,
                                  VariableQuery query) {
  Variables variables;
  for (bool goes_on = true; goes_on;) {
    PLCHOST_CO_TRY_ASSIGN(const auto page,
                          co_await core.list_variables(host, instance, query, order.deadline()));
    PLCHOST_CO_TRY_ASSIGN(goes_on, next_page(host, page, query));
    for (const plc_VariableRecord& variable : page.variables) variables.push_back(to_public(variable));
  }
  co_return variables;
}

Async<Result<Variables>> list_variables(CallOrder& order, ClientCore& core, std::string host,
                                        std::string instance, VariableQuery query) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  co_return co_await read_all(order, core, place.host, instance, query);
}

Async<Result<Client::Sample>> sample_in_turn(CallOrder& order, ClientCore& core, std::string host,
                                             std::string instance, VariableQuery query) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  co_return co_await read_sample(core, place.host, instance, query, order.deadline());
}

/// Those that have forces. `instance`: only this one; empty: all. not_found: there is none of that name.
Result<std::vector<std::string>> forced_instances(const std::vector<plc_InstanceStatus>& all,
                                                  const std::string& host, const std::string& instance) {
  std::vector<std::string> forced;
  std::vector<std::string_view> names;
  for (const plc_InstanceStatus& each : all) {
    const std::string_view name = names.emplace_back(dds::text_of(each.instance));
    if (each.forces > 0 && (instance.empty() || name == instance)) forced.emplace_back(name);
  }
  if (instance.empty() || std::ranges::find(names, instance) != names.end()) return forced;
  return failure(ErrorCode::not_found, fmt::format("no instance '{}' on host '{}'; there are: {}",
                                                   shown(instance), host, join_names(names)));
}

Async<Result<Forces>> list_forces(CallOrder& order, ClientCore& core, std::string host,
                                  std::string instance) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  PLCHOST_CO_TRY_ASSIGN(const auto all, co_await core.status<plc_InstanceStatus>(place.host, place.deadline));
  PLCHOST_CO_TRY_ASSIGN(const auto forced, forced_instances(all, place.host, instance));
  Forces forces;
  for (const std::string& name : forced) {
    PLCHOST_CO_TRY_ASSIGN(auto variables, co_await read_all(order, core, place.host, name, {.forced = true}));
    for (Client::Variable& variable : variables) forces.push_back({std::move(variable), place.host, name});
  }
  co_return forces;
}

constexpr std::string_view kAllForced = "*";

// The host would take "a=b" for a and a value. A pattern names no single variable.
std::string variable_name(const std::string& name) {
  const bool good =
      !name.empty() && name.find_first_of("=*?") == std::string::npos && is_printable_utf8(name);
  if (!good) {
    throw_client_error(
        {ErrorCode::invalid_argument, 0,
         fmt::format("'{}' is no name of a variable, as Line.speed or Grid[1,2]", shown(name))});
  }
  return name;
}

std::string assignment(const std::string& name, const std::string& value) {
  if (!is_printable_utf8(value)) {
    throw_client_error({ErrorCode::invalid_argument, 0,
                        fmt::format("{}: '{}' is no value", variable_name(name), shown(value))});
  }
  return variable_name(name) + "=" + value;
}

}  // namespace

Async<Result<Client::Sample>> read_sample(ClientCore& core, std::string host, std::string instance,
                                          VariableQuery query, TimePoint deadline) {
  PLCHOST_CO_TRY_ASSIGN(auto listed, co_await core.list_variables(host, instance, query, deadline));
  PLCHOST_CO_TRY_ASSIGN(const auto page, sample_in(std::move(listed), instance, query));
  Client::Sample sample{.time = wall_time(page.time_unix_ns), .consistent = page.consistent, .variables = {}};
  for (const plc_VariableRecord& variable : page.variables) sample.variables.push_back(to_public(variable));
  co_return sample;
}

void check_sample_interval(std::chrono::milliseconds interval) {
  if (interval >= kMinSampleInterval && interval <= kMaxSampleInterval) return;
  throw_client_error({ErrorCode::invalid_argument, 0,
                      fmt::format("interval {} ms: allowed are {} to {}", interval.count(),
                                  kMinSampleInterval.count(), kMaxSampleInterval.count())});
}

VariableQuery checked_query(const std::vector<std::string>& patterns) {
  VariableQuery query{.patterns = patterns};
  if (const auto good = part_of(query); !good) throw_client_error(good.error());
  return query;
}

std::vector<Client::Variable> Client::variables(const std::string& host, const std::string& instance,
                                                const std::vector<std::string>& patterns) {
  const VariableQuery query{.patterns = patterns};
  return value_or_throw(worker_->run<Variables>(
      [&](ClientCore& core) { return list_variables(worker_->order(), core, host, instance, query); }));
}

Client::Sample Client::sample(const std::string& host, const std::string& instance,
                              const std::vector<std::string>& patterns) {
  const VariableQuery query{.patterns = patterns};
  return value_or_throw(worker_->run<Sample>(
      [&](ClientCore& core) { return sample_in_turn(worker_->order(), core, host, instance, query); }));
}

std::vector<Client::Force> Client::forces(const std::string& host, const std::string& instance) {
  return value_or_throw(worker_->run<Forces>(
      [&](ClientCore& core) { return list_forces(worker_->order(), core, host, instance); }));
}

std::string Client::write_variable(const std::string& host, const std::string& instance,
                                   const std::string& name, const std::string& value) {
  return command("write variable", host, instance, assignment(name, value));
}

std::string Client::force_variable(const std::string& host, const std::string& instance,
                                   const std::string& name, const std::string& value) {
  return command("force variable", host, instance, assignment(name, value));
}

std::string Client::unforce_variable(const std::string& host, const std::string& instance,
                                     const std::string& name) {
  if (name == kAllForced) return unforce_all(host, instance);
  return command("unforce variable", host, instance, variable_name(name));
}

std::string Client::unforce_all(const std::string& host, const std::string& instance) {
  return command("unforce variable", host, instance, std::string(kAllForced));
}

}  // namespace plchost
