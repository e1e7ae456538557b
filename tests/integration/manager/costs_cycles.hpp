#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/integration/manager/plant.hpp"
#include "tests/support/core_witness.hpp"
#include "tests/support/further_round.hpp"
#include "tests/support/sanitized.hpp"

namespace plchost {

/// The instance must go on meanwhile.
inline std::uint64_t lost_while(Plant& plant, const std::string& instance,
                                const std::function<void()>& during) {
  const TaskCounters before = plant.counters(instance);
  during();
  EXPECT_TRUE(plant.wait_for_cycles(instance));
  const TaskCounters after = plant.counters(instance);
  EXPECT_GT(after.cycles, before.cycles);
  return after.lost_cycles - before.lost_cycles;
}

/// Whether `disturb` costs an instance with a shortest interval of 1 ms cycles. One round without a loss
/// shows that it does not, apart from cycles that a witness on the same core would have lost as well.
/// Programs with a sanitizer are too slow to tell: one round, and false.
inline bool costs_cycles(Plant& plant, const std::string& instance,
                         const std::function<void(std::uint32_t round)>& disturb,
                         const std::function<void(std::string_view)>& say = say_further_round) {
  constexpr std::uint32_t kRounds = 8;
  const CoreWitness witness(plant.status(instance).core, std::chrono::milliseconds(1));
  for (std::uint32_t round = 1; round <= kRounds; ++round) {
    const std::uint64_t before = witness.taken();
    const std::uint64_t lost = lost_while(plant, instance, [&] { disturb(round); });
    const std::uint64_t taken = witness.taken() - before;
    if (lost <= taken || kSanitized) return false;
    say(fmt::format("{} lost {} cycles in round {}, of which its core took {} at most", instance, lost, round,
                    taken));
  }
  return true;
}

}  // namespace plchost
