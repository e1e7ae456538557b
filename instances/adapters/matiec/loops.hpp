#pragma once

#include <string>
#include <string_view>

namespace plchost::matiec {

/// The C code of iec2c, in which each loop of FOR has its first turn. By itself it looks before each turn
/// whether the next value lies within the bounds, and before the first one, too: `FOR i := 1 TO 1` has none.
/// Loops of another form stay as they are.
[[nodiscard]] std::string with_first_turns(std::string_view code);

}  // namespace plchost::matiec
