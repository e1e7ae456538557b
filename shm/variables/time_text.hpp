#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost {

// Times and dates as Structured Text writes them, without the prefix of their type. All of them are
// nanoseconds: a duration, since 1970 (UTC, proleptic calendar), or since midnight.

enum class TimeForm : std::uint8_t { duration, date, time_of_day, date_and_time };

/// "T#", "D#", "TOD#" or "DT#", and what follows. A time of day that is none is shown as its number.
[[nodiscard]] std::string time_text(TimeForm form, std::int64_t nanoseconds);

/// The value of the text behind the prefix. invalid_argument: says what is allowed.
[[nodiscard]] Result<std::int64_t> parse_time(TimeForm form, std::string_view text);

}  // namespace plchost
