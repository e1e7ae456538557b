#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "shm/base/time.hpp"
#include "tests/integration/manager/plant.hpp"
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

/// Whether `disturb` costs `instance` cycles. One round without a loss shows that it does not. A core stands
/// still for other reasons, too: after a round with a loss follows a calm stretch of the same length. If each
/// round loses cycles, and half of the calm stretches do, the losses are the machine's. If it lost none in
/// the calm before the first round, they are not: some disturbances last. Programs with a
/// sanitizer are too slow to tell: one round, and false.
inline bool costs_cycles(Plant& plant, const std::string& instance,
                         const std::function<void(std::uint32_t round)>& disturb,
                         const std::function<void(std::string_view)>& say = say_further_round) {
  constexpr std::uint32_t kRounds = 8;
  const auto calm_for = [&](Duration time) {
    return lost_while(plant, instance, [time] { std::this_thread::sleep_for(time); });
  };
  if (kSanitized) {
    (void)lost_while(plant, instance, [&] { disturb(1); });
    return false;
  }
  const std::uint64_t before = calm_for(std::chrono::seconds(1));
  std::uint32_t calm_with_loss = 0;
  for (std::uint32_t round = 1; round <= kRounds; ++round) {
    Duration time{};
    const std::uint64_t lost = lost_while(plant, instance, [&] {
      const TimePoint began = MonotonicClock::now();
      disturb(round);
      time = MonotonicClock::now() - began;
    });
    if (lost == 0) return false;
    const std::uint64_t calm = calm_for(time);
    if (calm > 0) ++calm_with_loss;
    say(fmt::format("{} lost {} cycles in round {}, {} in calm, {} in calm before", instance, lost, round,
                    calm, before));
  }
  return before == 0 || calm_with_loss < kRounds / 2;
}

}  // namespace plchost
