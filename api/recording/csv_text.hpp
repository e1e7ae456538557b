#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace plchost {

/// A time of a host, ISO 8601, UTC, to the millisecond: "2026-11-21T10:48:59.502Z". Empty for none (0).
[[nodiscard]] std::string time_text(std::int64_t unix_ns);

/// A field of comma-separated values, as RFC 4180 has it: in quotes where that is needed.
[[nodiscard]] std::string csv_cell(std::string_view text);

}  // namespace plchost
