#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace plchost::plcopen {

/// A duration of ISO 8601 in nanoseconds: PT0.02S, P1DT2H. None: it is none, has years or months, or is too
/// long. Parts of a nanosecond are left out.
[[nodiscard]] std::optional<std::int64_t> iso_nanoseconds(std::string_view text);

/// As ST writes it, in the largest unit that needs no fraction: T#20ms.
[[nodiscard]] std::string time_literal(std::int64_t nanoseconds);

}  // namespace plchost::plcopen
