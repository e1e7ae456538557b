#include "api/cli/cli_session.hpp"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "api/cli/terminal.hpp"
#include "api/dds/log_sink.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

Result<ControlClient*> CliSession::client() {
  if (!client_) {
    dds::install_log_sink();
    PLCHOST_TRY_ASSIGN(client_, ControlClient::connect(options.dds, options.hosts.names_one()
                                                                        ? std::string_view(options.hosts.host)
                                                                        : std::string_view()));
  }
  return client_.get();
}

Duration CliSession::timeout() const {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(options.timeout_s));
}

TimePoint CliSession::deadline() const {
  return MonotonicClock::now() + timeout();
}

TimePoint CliSession::deadline(Duration least) const {
  return MonotonicClock::now() + (options.timeout_given ? timeout() : std::max(timeout(), least));
}

namespace {

std::vector<Row> only(const std::vector<Row>& rows, const std::vector<Column>& columns) {
  std::vector<Row> chosen;
  for (const Row& row : rows) {
    Row one = Row::object();
    for (const Column& column : columns)
      one[column.field] = row.contains(column.field) ? row.at(column.field) : Row();
    chosen.push_back(std::move(one));
  }
  return chosen;
}

std::unexpected<Error> none_selected(const std::vector<HostView>& hosts) {
  std::vector<std::string> names;
  for (const HostView& host : hosts) {
    const auto labels = host.labels();
    names.push_back(labels.empty() ? host.name : fmt::format("{} ({})", host.name, fmt::join(labels, ", ")));
  }
  return failure(
      ErrorCode::not_found,
      fmt::format("no host matches --host and --label; those that answer: {}", fmt::join(names, ", ")));
}

}  // namespace

Result<std::vector<HostView>> CliSession::shown_hosts() {
  PLCHOST_TRY_ASSIGN(const auto connected, client());
  const HostSelection& selection = options.hosts;
  if (selection.names_one()) {
    auto one = connected->host(selection.host, deadline());
    if (!one) return failure(ErrorCode::unavailable, one.error().message);
    if (selection.selects(*one)) return std::vector{std::move(*one)};
    return none_selected({*std::move(one)});
  }
  return select(connected->hosts(deadline()));
}

Result<std::vector<HostView>> CliSession::known_hosts() {
  PLCHOST_TRY_ASSIGN(const auto connected, client());
  const auto known = connected->known_hosts(deadline());
  // For the names of those that answer.
  if (known.empty() && options.hosts.names_one()) return shown_hosts();
  return select(known);
}

Result<std::vector<HostView>> CliSession::select(const std::vector<HostView>& all) const {
  std::vector<HostView> selected;
  std::ranges::copy_if(all, std::back_inserter(selected),
                       [&](const HostView& host) { return options.hosts.selects(host); });
  if (!selected.empty()) return selected;
  if (!all.empty()) return none_selected(all);
  return failure(
      ErrorCode::unavailable,
      fmt::format("no host answers in DDS domain {} within {} s: start one with 'plchostd --config FILE', "
                  "or choose its domain with --domain{}",
                  options.dds.domain, options.timeout_s,
                  options.dds.identity.empty()
                      ? "; a secured host needs an --identity"
                      : "; a host that does not accept this identity does not answer"));
}

Result<std::string> CliSession::target_host() {
  PLCHOST_TRY_ASSIGN(const auto hosts, shown_hosts());
  if (hosts.size() == 1) return hosts.front().name;
  std::vector<std::string_view> names;
  for (const HostView& host : hosts) names.emplace_back(host.name);
  return failure(
      ErrorCode::invalid_argument,
      fmt::format("several hosts answer, and this is for one; say which with --host: {}", join_names(names)));
}

Result<std::vector<std::string>> CliSession::target_hosts() {
  if (!options.hosts.means_many()) {
    PLCHOST_TRY_ASSIGN(auto one, target_host());
    return std::vector{std::move(one)};
  }
  PLCHOST_TRY_ASSIGN(const auto hosts, shown_hosts());
  std::vector<std::string> names;
  for (const HostView& host : hosts) names.push_back(host.name);
  return names;
}

Result<void> CliSession::check_instance(const std::string& instance) {
  PLCHOST_TRY_ASSIGN(const auto hosts, shown_hosts());
  std::vector<std::string> names;
  for (const HostView& host : hosts) {
    PLCHOST_TRY_ASSIGN(const auto instances, client_->instances(host.name, deadline()));
    for (const auto& known : instances) names.emplace_back(dds::text_of(known.instance));
  }
  if (std::ranges::find(names, instance) != names.end()) return {};
  return unknown_name("instance", instance, names);
}

int CliSession::show(std::vector<Row> rows, std::vector<Column> columns) const {
  if (!options.sort_by.empty()) {
    if (const auto sorted = sort_rows(rows, options.sort_by); !sorted) return fail(sorted.error());
  }
  if (!options.columns.empty()) {
    auto chosen = choose_columns(options.columns, rows, columns);
    if (!chosen) return fail(chosen.error());
    columns = *std::move(chosen);
    if (options.json || options.csv) rows = only(rows, columns);
  }
  if (options.csv) {
    fmt::print("{}", format_csv(rows));
  } else if (options.json) {
    fmt::print("{}", format_json(rows));
  } else {
    const bool all = options.wide || !options.columns.empty();
    fmt::print("{}", format_table(rows, columns,
                                  {.coloured = options.coloured, .width = all ? 0 : terminal_width()}));
  }
  std::fflush(stdout);
  return kExitDone;
}

void CliSession::say(std::string_view text) const {
  if (options.quiet || options.json || options.csv) return;
  fmt::print("{}\n", printable(std::string(text)));
  std::fflush(stdout);
}

int CliSession::fail(const Error& error) {
  fmt::print(stderr, "plcctl: {}\n", printable(error.describe()));
  if (error.code == ErrorCode::timed_out || error.code == ErrorCode::unavailable) return kExitNoAnswer;
  return error.code == ErrorCode::invalid_argument ? kExitUsage : kExitFailed;
}

std::string hint(std::string_view unknown, const std::vector<std::string>& known) {
  const std::vector<std::string_view> views(known.begin(), known.end());
  const auto near = nearest_name(unknown, views);
  return near.empty() || near == unknown ? "" : fmt::format(" (did you mean '{}'?)", near);
}

std::unexpected<Error> unknown_name(std::string_view what, std::string_view name,
                                    const std::vector<std::string>& known, std::string_view host) {
  const std::string where = host.empty() ? "" : fmt::format(" on host '{}'", host);
  return failure(ErrorCode::not_found, fmt::format("no {} '{}'{}{}; there are: {}", what, name, where,
                                                   hint(name, known), fmt::join(known, ", ")));
}

}  // namespace plchost
