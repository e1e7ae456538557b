#include "api/cli/rows/host_rows.hpp"

#include <charconv>
#include <string>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "api/cli/rows/rows.hpp"
#include "api/client/status_count.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

/// The number that a host tells as a text; null: it tells none.
template <class Number>
Row number_of(const HostView& host, std::string_view entry) {
  const std::string text = host.entry(entry);
  Number number{};
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool whole = read.ec == std::errc() && read.ptr == text.data() + text.size();
  return whole && !text.empty() ? Row(number) : Row();
}

std::string problem_of(const HostView& host) {
  if (host.contested) return "two hosts have this name and show it at the same time";
  const std::string rival = host.entry(dds::kRivalEntry);
  if (!rival.empty()) return fmt::format("another host wants this name and is refused: {}", rival);
  const std::string unsaved = host.entry(dds::kUnsavedEntry);
  if (!unsaved.empty()) return fmt::format("retain variables are not written: {}", unsaved);
  const std::string unrecorded = host.entry(dds::kUnrecordedEntry);
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
  const std::string secured = host.entry(dds::kSecuredEntry);
  Row row{{"host", host.name},
          {"state", host.silent ? "silent" : "alive"},
          {"version", dds::text_of(host.status.version)},
          {"uptime_s", uptime_s(host, clock)},
          {"started_unix_s", host.status.started_unix_ns / kSecond},
          {"running", number_of<std::uint32_t>(host, dds::kRunningEntry)},
          {"instances", count_of<plc_InstanceStatus>(host.status).value_or(0)},
          {"tasks", count_of<plc_TaskStatus>(host.status).value_or(0)},
          {"events", count_of<plc_EventStatus>(host.status).value_or(0)},
          {"objects", count_of<plc_ObjectStatus>(host.status).value_or(0)},
          {"load", number_of<double>(host, dds::kLoadEntry)},
          {"cores", number_of<std::uint32_t>(host, dds::kCoresEntry)},
          {"memory_mib", number_of<std::uint64_t>(host, dds::kMemoryEntry)},
          {"available_mib", number_of<std::uint64_t>(host, dds::kAvailableEntry)},
          {"clock_offset_us", clock ? Row(to_us(clock->offset.count())) : Row()},
          {"clock_uncertainty_us", clock ? Row(to_us(clock->uncertainty.count())) : Row()},
          {"secured", secured.empty() ? Row() : Row(secured == "yes")},
          {"manager_pid", host.status.manager_pid},
          {"server_pid", host.server_pid},
          {"problem", problem_of(host)}};
  add_extension(row, host.ext);
  row["labels"] = fmt::format("{}", fmt::join(host.labels(), ","));
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
