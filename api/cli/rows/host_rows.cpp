#include "api/cli/rows/host_rows.hpp"

#include <cstdint>
#include <string_view>

#include <fmt/format.h>

#include "api/cli/rows/rows.hpp"
#include "api/client/status_count.hpp"
#include "api/dds/text.hpp"

namespace plchost {

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

Row load_of(const plc_HostStatus& status) {
  constexpr double kPercent = 100;
  return status.load_percent < 0 ? Row() : Row(status.load_percent / kPercent);
}

std::string problem_of(const HostView& host) {
  if (host.contested) return "two hosts have this name and show it at the same time";
  const std::string_view rival = dds::text_of(host.status.rival);
  if (!rival.empty()) return fmt::format("another host wants this name and is refused: {}", rival);
  const std::string_view unsaved = dds::text_of(host.status.unsaved);
  if (!unsaved.empty()) return fmt::format("retain variables are not written: {}", unsaved);
  const std::string_view unrecorded = dds::text_of(host.status.unrecorded);
  return unrecorded.empty() ? "" : fmt::format("changes are not recorded: {}", unrecorded);
}

/// For how long its manager has run, by its own clock.
Row uptime_s(const HostView& host, const std::optional<ClockOffset>& clock) {
  const std::int64_t started = host.status.started_unix_ns;
  if (started == 0 || !clock) return {};
  return (unix_time_ns() + clock->offset.count() - started) / kSecond;
}

}  // namespace

dds::Computed<plc_HostStatus, Row> computed_of(const plc_HostStatus& status, const HostView& host,
                                               const std::optional<ClockOffset>& clock) {
  const bool follows = status.grid_instances != 0;
  const bool measured = follows && status.grid_measured != 0;
  return {.state = host.silent ? "silent" : "alive",
          .uptime_s = uptime_s(host, clock),
          .started_unix_s = status.started_unix_ns / kSecond,
          .instances = count_of<plc_InstanceStatus>(status).value_or(0),
          .tasks = count_of<plc_TaskStatus>(status).value_or(0),
          .events = count_of<plc_EventStatus>(status).value_or(0),
          .load = load_of(status),
          .clock_offset_us = clock ? Row(to_us(clock->offset.count())) : Row(),
          .clock_uncertainty_us = clock ? Row(to_us(clock->uncertainty.count())) : Row(),
          .grid_offset_us = measured ? Row(to_us(status.grid_offset_ns)) : Row(),
          .grid_in_sync = follows ? Row(status.grid_in_sync == status.grid_instances) : Row(),
          .server_pid = host.server_pid,
          .problem = problem_of(host)};
}

Row to_row(const HostView& host, const std::optional<ClockOffset>& clock) {
  Row row = to_row(host.status, host, clock);
  add_extension(row, host.ext);
  return row;
}

}  // namespace plchost
