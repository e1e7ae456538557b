#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <control.h>

#include "api/cli/rows/table.hpp"

namespace plchost {

/// The values of a host beyond the fields that this program knows. A name that is taken stays what it is.
void add_extension(Row& row, std::span<const plc_KeyValue> entries);

/// A time of a host in these rows, ISO 8601, UTC, to the millisecond: "2026-11-21T10:48:59.502Z". Empty for
/// none (0).
[[nodiscard]] std::string time_text(std::int64_t unix_ns);

/// Durations are in microseconds in all rows.
[[nodiscard]] constexpr double to_us(std::int64_t nanoseconds) noexcept {
  return static_cast<double>(nanoseconds) / 1000.0;
}

}  // namespace plchost
