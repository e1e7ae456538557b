#pragma once

#include "api/cli/command.hpp"

namespace plchost {

/// Does it again and again until Ctrl-C, on a terminal each time on a clean screen. Returns what it gave
/// last; where the output is no terminal, also as soon as it has failed.
[[nodiscard]] int repeat(double every_s, const Action& action);

}  // namespace plchost
