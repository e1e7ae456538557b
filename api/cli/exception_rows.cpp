#include <chrono>
#include <cstdint>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "api/cli/rows.hpp"
#include "api/dds/text.hpp"

namespace plchost {

namespace {

constexpr std::int64_t kPerSecond = 1'000'000'000;
constexpr std::int64_t kPerMillisecond = 1'000'000;

// ISO 8601, UTC, to the millisecond.
std::string to_time(std::int64_t unix_ns) {
  if (unix_ns <= 0) return {};
  const auto seconds = static_cast<std::time_t>(unix_ns / kPerSecond);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(seconds),
                     unix_ns % kPerSecond / kPerMillisecond);
}

}  // namespace

Row to_row(const plc_ExceptionStatus& status) {
  using dds::text_of;
  return {{"host", text_of(status.host)},
          {"instance", text_of(status.instance)},
          {"count", status.count},
          {"present", status.present},
          {"time", to_time(status.time_unix_ns)},
          {"time_unix_ns", status.time_unix_ns},
          {"task", text_of(status.task)},
          {"stopped", status.count == 0 ? "" : (status.whole_application ? "application" : "task")},
          {"kind", text_of(status.kind)},
          {"signal", text_of(status.signal)},
          {"text", text_of(status.text)},
          {"address", status.address},
          {"symbol", text_of(status.symbol)},
          {"memory_address", status.memory_address},
          {"application", text_of(status.application)}};
}

const std::vector<Column>& exception_columns() {
  static const std::vector<Column> columns{
      {"host", "HOST"}, {"instance", "INSTANCE"}, {"present", "PRESENT"}, {"count", "COUNT"},
      {"time", "TIME"}, {"task", "TASK"},         {"kind", "KIND"},       {"text", "TEXT"}};
  return columns;
}

}  // namespace plchost
