#include "api/cli/verbs/host_commands.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "api/dds/object_query.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

Duration wait_for(std::int32_t operation) {
  const Operation* const known = find_operation(operation);
  return known != nullptr ? least_wait(*known) : Duration::zero();
}

namespace {

// A refusal does not name the instance that was meant.
std::string advice(CliSession& session, const HostOutcome& outcome, const std::string& instance) {
  if (outcome.reply->code != ErrorCode::not_found) return "";
  std::vector<std::string> names;
  if (const auto all = session.client().value()->instances(outcome.host, session.deadline())) {
    for (const auto& known : *all) names.emplace_back(dds::text_of(known.instance));
  }
  return hint(instance, names);
}

std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    lines.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

/// Says what became of it at one of `count` hosts; its exit code.
int tell(CliSession& session, const HostOutcome& outcome, const std::string& instance, std::size_t count,
         std::string_view done) {
  const std::string where = count > 1 ? outcome.host + ": " : "";
  if (!outcome.reply) {
    Error error = outcome.reply.error();
    error.message = where + error.message;
    return CliSession::fail(error);
  }
  if (outcome.reply->code != ErrorCode::ok) {
    for (const std::string& line : lines_of(outcome.reply->text + advice(session, outcome, instance))) {
      fmt::print(stderr, "plcctl: {}\n", printable(where + line));
    }
    return kExitFailed;
  }
  if (outcome.reply->text.empty()) session.say(fmt::format("{}{}: {}", where, instance, done));
  for (const std::string& line : lines_of(outcome.reply->text)) session.say(where + line);
  return kExitDone;
}

Row row_of(const HostOutcome& outcome, const std::string& instance) {
  const bool done = outcome.reply && outcome.reply->code == ErrorCode::ok;
  return {{"host", outcome.host},
          {"instance", instance},
          {"done", done},
          {"remark", outcome.reply ? outcome.reply->text : outcome.reply.error().describe()}};
}

}  // namespace

namespace {

int command_on(CliSession& session, const std::vector<std::string>& hosts, const ApiRequest& request,
               std::string_view done) {
  const TimePoint deadline = session.deadline(wait_for(request.operation));
  return ask_hosts(
      session, hosts, request.instance,
      [&](ClientCore& core, const std::string& host) {
        ApiRequest own = request;
        own.host = host;
        return core.call(own, deadline);
      },
      done);
}

bool is_pattern(std::string_view name) {
  return name.find_first_of("*?") != std::string_view::npos;
}

/// All instances of the hosts that are shown, in the order of their hosts.
Result<std::vector<NamedInstance>> all_instances(CliSession& session) {
  PLCHOST_TRY_ASSIGN(const auto hosts, session.shown_hosts());
  std::vector<NamedInstance> all;
  for (const HostView& host : hosts) {
    PLCHOST_TRY_ASSIGN(const auto samples,
                       session.client().value()->instances(host.name, session.deadline()));
    for (const plc_InstanceStatus& sample : samples) {
      const std::string name(dds::text_of(sample.instance));
      auto known = std::ranges::find(all, name, &NamedInstance::name);
      if (known == all.end()) known = all.insert(all.end(), {.name = name, .hosts = {}});
      known->hosts.push_back(host.name);
    }
  }
  return all;
}

}  // namespace

int command(CliSession& session, const ApiRequest& request, std::string_view done) {
  const auto hosts = session.target_hosts();
  if (!hosts) return CliSession::fail(hosts.error());
  return command_on(session, *hosts, request, done);
}

Result<std::vector<NamedInstance>> expand(CliSession& session, const std::vector<std::string>& names) {
  std::vector<NamedInstance> expanded;
  std::optional<std::vector<NamedInstance>> all;
  for (const std::string& name : names) {
    if (!is_pattern(name)) {
      expanded.push_back({.name = name, .hosts = {}});
      continue;
    }
    if (!all) {
      PLCHOST_TRY_ASSIGN(all, all_instances(session));
    }
    const std::size_t before = expanded.size();
    std::ranges::copy_if(*all, std::back_inserter(expanded),
                         [&](const NamedInstance& one) { return matches_pattern(name, one.name); });
    if (expanded.size() > before) continue;
    std::vector<std::string> known;
    for (const NamedInstance& one : *all) known.push_back(one.name);
    return unknown_name("instance", name, known);
  }
  return expanded;
}

int command_each(CliSession& session, const std::vector<std::string>& names, const ApiRequest& request,
                 std::string_view done) {
  const auto instances = expand(session, names);
  if (!instances) return CliSession::fail(instances.error());
  const auto hosts = session.target_hosts();
  if (!hosts) return CliSession::fail(hosts.error());
  int code = kExitDone;
  for (const NamedInstance& one : *instances) {
    ApiRequest own = request;
    own.instance = one.name;
    code = std::max(code, command_on(session, one.hosts.empty() ? *hosts : one.hosts, own, done));
  }
  return code;
}

int ask_hosts(CliSession& session, const std::vector<std::string>& hosts, const std::string& instance,
              const HostCall& call, std::string_view done) {
  const std::vector<HostOutcome> outcomes = ask_each(*session.client().value(), hosts, call);
  int code = kExitDone;
  std::vector<Row> rows;
  for (const HostOutcome& outcome : outcomes) {
    code = std::max(code, tell(session, outcome, instance, outcomes.size(), done));
    if (outcomes.size() > 1 || code == kExitDone) rows.push_back(row_of(outcome, instance));
  }
  if ((session.options.json || session.options.csv) && !rows.empty())
    code = std::max(code, session.show(rows, {}));
  return code;
}

}  // namespace plchost
