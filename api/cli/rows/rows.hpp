#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <control.h>

#include "api/cli/rows/table.hpp"
#include "api/recording/csv_text.hpp"

namespace plchost {

/// The values of a host beyond the fields that this program knows. A name that is taken stays what it is.
void add_extension(Row& row, std::span<const plc_KeyValue> entries);

/// Durations are in microseconds in all rows.
[[nodiscard]] constexpr double to_us(std::int64_t nanoseconds) noexcept {
  return static_cast<double>(nanoseconds) / 1000.0;
}

}  // namespace plchost
