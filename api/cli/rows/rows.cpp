#include "api/cli/rows/rows.hpp"

#include <charconv>
#include <cstdint>
#include <span>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "api/dds/text.hpp"

namespace plchost {

using dds::text_of;

namespace {

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

void add_extension(Row& row, std::span<const plc_KeyValue> entries) {
  for (const plc_KeyValue& entry : entries) {
    const std::string name(text_of(entry.name));
    if (!row.contains(name)) row[name] = value_of(text_of(entry.value));
  }
}

}  // namespace plchost
