#include "api/cli/rows/rows.hpp"

#include <cstdint>
#include <ctime>
#include <span>
#include <string_view>

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
    if (!row.contains(name)) row[name] = text_of(entry.value);
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
          {"problem", text_of(status.problem)}};
  add_extension(row, std::span(status.ext._buffer, status.ext._length));
  return row;
}

Row to_row(const plc_TaskStatus& status) {
  return {{"host", text_of(status.host)},
          {"instance", text_of(status.instance)},
          {"task", text_of(status.task)},
          {"kind", dds::task_kind_name(status.kind)},
          {"priority", status.priority},
          {"interval_us", to_us(status.interval_ns)},
          {"state", dds::task_state_name(status.state)},
          {"cycles", status.cycles},
          {"lost_cycles", status.lost_cycles},
          {"lost_events", status.lost_events},
          {"exec_last_us", to_us(status.exec_last_ns)},
          {"exec_avg_us", to_us(status.exec_avg_ns)},
          {"exec_min_us", to_us(status.exec_min_ns)},
          {"exec_max_us", to_us(status.exec_max_ns)},
          {"latency_p50_us", to_us(status.latency_p50_ns)},
          {"latency_p99_us", to_us(status.latency_p99_ns)},
          {"latency_max_us", to_us(status.latency_max_ns)},
          {"jitter_max_us", to_us(status.jitter_max_ns)},
          {"external_event", text_of(status.external_event)}};
}

Row to_row(const plc_EventStatus& status) {
  return {{"host", text_of(status.host)},      {"instance", text_of(status.instance)},
          {"event", text_of(status.event)},    {"registered", status.registered},
          {"bound_tasks", status.bound_tasks}, {"posts", status.posts}};
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
  static const std::vector<Column> columns{{"time", "TIME"},       {"host", "HOST"}, {"instance", "INSTANCE"},
                                           {"sequence", "NUMBER"}, {"of", "OF"},     {"from", "FROM"},
                                           {"to", "TO"},           {"pid", "PID"},   {"reason", "REASON"}};
  return columns;
}

const std::vector<Column>& instance_columns() {
  static const std::vector<Column> columns{{"host", "HOST"},         {"name", "NAME"},
                                           {"state", "STATE"},       {"pid", "PID"},
                                           {"core", "CORE"},         {"scheduler", "SCHEDULER"},
                                           {"restarts", "RESTARTS"}, {"application", "APPLICATION"},
                                           {"problem", "PROBLEM"}};
  return columns;
}

const std::vector<Column>& task_columns() {
  static const std::vector<Column> columns{{"host", "HOST"},
                                           {"instance", "INSTANCE"},
                                           {"task", "TASK"},
                                           {"kind", "KIND"},
                                           {"priority", "PRIO"},
                                           {"interval_us", "INTERVAL(us)", 0},
                                           {"state", "STATE"},
                                           {"cycles", "CYCLES"},
                                           {"lost_cycles", "LOST"},
                                           {"lost_events", "LOST-EV"},
                                           {"exec_avg_us", "EXEC-AVG(us)"},
                                           {"exec_max_us", "EXEC-MAX(us)"},
                                           {"latency_p50_us", "LAT-P50(us)"},
                                           {"latency_p99_us", "LAT-P99(us)"},
                                           {"latency_max_us", "LAT-MAX(us)"},
                                           {"jitter_max_us", "JITTER-MAX(us)"}};
  return columns;
}

const std::vector<Column>& event_columns() {
  static const std::vector<Column> columns{{"host", "HOST"},         {"instance", "INSTANCE"},
                                           {"event", "EVENT"},       {"registered", "REGISTERED"},
                                           {"bound_tasks", "TASKS"}, {"posts", "POSTS"}};
  return columns;
}

}  // namespace plchost
