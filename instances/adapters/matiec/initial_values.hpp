#pragma once

#include <string>
#include <string_view>

namespace plchost::matiec {

/// The C code of iec2c, in which functions that set initial values are marked: they run once, and have a line
/// for each variable. See plchost_once.h.
[[nodiscard]] std::string with_marked_initial_values(std::string_view code);

}  // namespace plchost::matiec
