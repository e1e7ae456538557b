#include "api/cli/rows/rows.hpp"

#include <charconv>
#include <cstdint>
#include <ctime>
#include <span>
#include <string_view>
#include <system_error>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "api/dds/code_names.hpp"
#include "api/dds/text.hpp"

namespace plchost {

using dds::text_of;

namespace {

std::int64_t to_seconds(std::int64_t nanoseconds) {
  return nanoseconds / 1'000'000'000;
}

std::int64_t to_ms(std::int64_t nanoseconds) {
  return nanoseconds / 1'000'000;
}

// Entries are texts; a whole number in one is a number for programs.
Row value_of(std::string_view text) {
  std::int64_t number = 0;
  const char* const end = text.data() + text.size();
  // NOLINTNEXTLINE(bugprone-suspicious-stringview-data-usage): `end` is the size
  const auto read = std::from_chars(text.data(), end, number);
  // "007" is a name, not 7.
  const bool whole = read.ec == std::errc() && read.ptr == end && fmt::format("{}", number) == text;
  return whole ? Row(number) : Row(text);
}

}  // namespace

std::string time_text(std::int64_t unix_ns) {
  if (unix_ns <= 0) return {};
  constexpr std::int64_t kPerMillisecond = 1'000'000;
  const auto seconds = static_cast<std::time_t>(to_seconds(unix_ns));
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(seconds), unix_ns / kPerMillisecond % 1000);
}

void add_extension(Row& row, std::span<const plc_KeyValue> entries) {
  for (const plc_KeyValue& entry : entries) {
    const std::string name(text_of(entry.name));
    if (!row.contains(name)) row[name] = value_of(text_of(entry.value));
  }
}

Row to_row(const plc_InstanceStatus& status) {
  Row row{{"host", text_of(status.host)},
          {"name", text_of(status.instance)},
          {"state", dds::instance_state_name(status.state)},
          {"pid", status.pid},
          {"core", status.core},
          {"scheduler", text_of(status.scheduler)},
          {"application", text_of(status.application)},
          {"restarts", status.restarts},
          {"state_since_unix_s", to_seconds(status.state_since_unix_ns)},
          {"problem", text_of(status.problem)},
          {"loaded", text_of(status.loaded)},
          {"configured", text_of(status.configured)},
          {"settings", text_of(status.settings)},
          {"band", text_of(status.priority_band)},
          {"after", text_of(status.after)},
          {"autostart", status.autostart},
          {"restart", dds::restart_policy_name(status.restart_policy)},
          {"restart_delay_ms", to_ms(status.restart_delay_ns)},
          {"restart_delay_max_ms", to_ms(status.restart_delay_max_ns)},
          {"crash_limit", status.crash_limit},
          {"crash_window_s", to_seconds(status.crash_window_ns)}};
  add_extension(row, std::span(status.ext._buffer, status.ext._length));
  return row;
}

Row to_row(const plc_Transition& transition) {
  const bool process = transition.source != 0;
  return {{"host", text_of(transition.host)},
          {"instance", text_of(transition.instance)},
          {"sequence", transition.sequence_number},
          {"time", time_text(transition.time_unix_ns)},
          {"of", process ? "process" : "application"},
          {"from", dds::transition_state_name(transition.source, transition.from_state)},
          {"to", dds::transition_state_name(transition.source, transition.to_state)},
          {"pid", transition.pid},
          {"time_unix_ns", transition.time_unix_ns},
          {"time_monotonic_ns", transition.time_monotonic_ns},
          {"reason", text_of(transition.reason)}};
}

const std::vector<Column>& transition_columns() {
  static const std::vector<Column> columns{{"time", "TIME"},
                                           {"host", "HOST"},
                                           {"instance", "INSTANCE"},
                                           {.field = "sequence", .header = "NUMBER", .rank = 3},
                                           {.field = "of", .header = "OF", .rank = 1},
                                           {"from", "FROM"},
                                           {"to", "TO"},
                                           {.field = "pid", .header = "PID", .rank = 2, .none = 0},
                                           {"reason", "REASON"}};
  return columns;
}

const std::vector<Column>& instance_columns() {
  static const std::vector<Column> columns{{.field = "host", .header = "HOST", .rank = 1},
                                           {.field = "name", .header = "NAME"},
                                           {.field = "state", .header = "STATE"},
                                           {.field = "pid", .header = "PID", .rank = 5, .none = 0},
                                           {.field = "core", .header = "CORE", .rank = 3, .none = -1},
                                           {.field = "scheduler", .header = "SCHEDULER", .rank = 4},
                                           {.field = "restarts", .header = "RESTARTS", .rank = 2},
                                           {.field = "application", .header = "APPLICATION", .rank = 6},
                                           {.field = "problem", .header = "PROBLEM"}};
  return columns;
}

const std::vector<Column>& task_columns() {
  static const std::vector<Column> columns{
      {.field = "host", .header = "HOST", .rank = 2},
      {.field = "instance", .header = "INSTANCE"},
      {.field = "task", .header = "TASK"},
      {.field = "kind", .header = "KIND", .rank = 3},
      {.field = "priority", .header = "PRIO", .rank = 4},
      {.field = "interval_us", .header = "INTERVAL(us)", .decimals = 0, .rank = 5},
      {.field = "state", .header = "STATE"},
      {.field = "cycles", .header = "CYCLES"},
      {.field = "lost_cycles", .header = "LOST"},
      {.field = "lost_events", .header = "LOST-EV", .rank = 1},
      {.field = "exec_avg_us", .header = "EXEC-AVG(us)", .rank = 7},
      {.field = "exec_max_us", .header = "EXEC-MAX(us)", .rank = 4},
      {.field = "latency_p50_us", .header = "LAT-P50(us)", .rank = 6},
      {.field = "latency_p99_us", .header = "LAT-P99(us)", .rank = 7},
      {.field = "latency_max_us", .header = "LAT-MAX(us)", .rank = 3},
      {.field = "jitter_max_us", .header = "JITTER-MAX(us)", .rank = 8}};
  return columns;
}

const std::vector<Column>& event_columns() {
  static const std::vector<Column> columns{{.field = "host", .header = "HOST", .rank = 1},
                                           {.field = "instance", .header = "INSTANCE"},
                                           {.field = "event", .header = "EVENT"},
                                           {.field = "registered", .header = "REGISTERED", .rank = 3},
                                           {.field = "bound_tasks", .header = "TASKS", .rank = 2},
                                           {.field = "posts", .header = "POSTS"}};
  return columns;
}

}  // namespace plchost
