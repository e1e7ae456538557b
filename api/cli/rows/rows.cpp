#include "api/cli/rows/rows.hpp"

#include <charconv>
#include <cstdint>
#include <ctime>
#include <span>
#include <string_view>
#include <system_error>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "api/dds/text.hpp"

namespace plchost {

using dds::text_of;

namespace {

std::int64_t to_seconds(std::int64_t nanoseconds) {
  return nanoseconds / 1'000'000'000;
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

}  // namespace plchost
