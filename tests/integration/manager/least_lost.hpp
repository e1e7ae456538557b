#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/integration/manager/plant.hpp"
#include "tests/support/further_round.hpp"

namespace plchost {

/// The cycles that `instance` loses while `disturb` runs: those of the best of three rounds, as a core stands
/// still for other reasons, too. The instance must go on in each of them.
inline std::uint64_t least_lost(Plant& plant, const std::string& instance,
                                const std::function<void(std::uint32_t round)>& disturb) {
  std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
  for (std::uint32_t round = 1; round <= 3 && least > 0; ++round) {
    const TaskCounters before = plant.counters(instance);
    disturb(round);
    EXPECT_TRUE(plant.wait_for_cycles(instance));
    const TaskCounters after = plant.counters(instance);
    EXPECT_GT(after.cycles, before.cycles);
    const std::uint64_t lost = after.lost_cycles - before.lost_cycles;
    if (lost > 0) say_further_round(fmt::format("{} lost {} cycles in round {}", instance, lost, round));
    least = std::min(least, lost);
  }
  return least;
}

}  // namespace plchost
