#pragma once

#include <cstdint>
#include <expected>
#include <string>
#include <string_view>

namespace plchost::iec {

/// A literal of TIME or LTIME, in nanoseconds: T#1m30s, TIME#-2.5ms, LT#10us. The error says what is allowed.
[[nodiscard]] std::expected<std::int64_t, std::string> nanoseconds_of(std::string_view literal);

}  // namespace plchost::iec
