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

/// 0: the host does not know it.
Row known(std::uint64_t number) {
  return number == 0 ? Row() : Row(number);
}

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

Row to_row(const HostView& host, const std::optional<ClockOffset>& clock) {
  Row row{{"host", host.name},
          {"state", host.silent ? "silent" : "alive"},
          {"version", dds::text_of(host.status.version)},
          {"uptime_s", uptime_s(host, clock)},
          {"started_unix_s", host.status.started_unix_ns / kSecond},
          {"running", host.status.running},
          {"instances", count_of<plc_InstanceStatus>(host.status).value_or(0)},
          {"tasks", count_of<plc_TaskStatus>(host.status).value_or(0)},
          {"events", count_of<plc_EventStatus>(host.status).value_or(0)},
          {"objects", count_of<plc_ObjectStatus>(host.status).value_or(0)},
          {"load", load_of(host.status)},
          {"cores", known(host.status.cores)},
          {"memory_mib", known(host.status.memory_mib)},
          {"available_mib", known(host.status.available_mib)},
          {"clock_offset_us", clock ? Row(to_us(clock->offset.count())) : Row()},
          {"clock_uncertainty_us", clock ? Row(to_us(clock->uncertainty.count())) : Row()},
          {"secured", host.status.secured},
          {"manager_pid", host.status.manager_pid},
          {"server_pid", host.server_pid},
          {"problem", problem_of(host)},
          {"labels", dds::text_of(host.status.labels)},
          {"audit_number", host.status.audit_number},
          {"audit_hash", dds::text_of(host.status.audit_hash)},
          {"unrecorded", dds::text_of(host.status.unrecorded)},
          {"rival", dds::text_of(host.status.rival)},
          {"unsaved", dds::text_of(host.status.unsaved)}};
  add_extension(row, host.ext);
  return row;
}

const std::vector<Column>& host_columns() {
  static const std::vector<Column> columns{
      {"host", "HOST"},
      {"state", "STATE"},
      {.field = "version", .header = "VERSION", .rank = 3},
      {.field = "uptime_s", .header = "UP(s)", .rank = 1},
      {"running", "RUNNING"},
      {"instances", "INSTANCES"},
      {.field = "load", .header = "LOAD", .decimals = 2, .rank = 2},
      {.field = "cores", .header = "CORES", .rank = 5},
      {.field = "available_mib", .header = "FREE(MiB)", .rank = 4},
      {.field = "clock_offset_us", .header = "CLOCK(us)", .decimals = 0, .rank = 6},
      {.field = "clock_uncertainty_us", .header = "+-(us)", .decimals = 0, .rank = 7},
      {.field = "secured", .header = "SECURED", .rank = 4},
      {"labels", "LABELS"},
      {"problem", "PROBLEM"}};
  return columns;
}

}  // namespace plchost
