#pragma once

#include <cstdint>

#include "api/cli/words/command.hpp"

namespace plchost {

struct Repetition {
  double every_s = 1;
  std::uint64_t count = 0;    ///< 0: until Ctrl-C
  bool for_programs = false;  ///< nothing between two outputs
};

/// Does it again and again; for people, on a terminal each time on a clean screen, else with an empty line
/// between. Returns what it gave last; where the output is no terminal, also as soon as it has failed.
[[nodiscard]] int repeat(const Repetition& repetition, const Action& action);

}  // namespace plchost
