#include <thread>

#include <gtest/gtest.h>

#include "schedulers/clock/clock.hpp"
#include "schedulers/tasks/activation_gate.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

TEST(LinuxClock, WaitEndsAtTheDeadlineAndNotBefore) {
  LinuxClock sut;
  const std::atomic<std::uint32_t> word{0};
  const TimePoint deadline = sut.now() + milliseconds(5);
  while (sut.now() < deadline) sut.wait(word, 0, deadline);
  EXPECT_GE(sut.now(), deadline);
}

TEST(LinuxClock, WaitReturnsIfTheWordHasChanged) {
  LinuxClock sut;
  const std::atomic<std::uint32_t> word{1};
  sut.wait(word, 0, kNoDeadline);
}

TEST(LinuxClock, SpinEndsAtTheDeadline) {
  LinuxClock sut;
  const TimePoint deadline = sut.now() + microseconds(50);
  sut.spin_until(deadline);
  EXPECT_GE(sut.now(), deadline);
}

TEST(LinuxClock, PeriodicTimerCountsWhatItMissed) {
  LinuxClock clock;
  const auto sut = clock.make_periodic_timer().value();
  const TimePoint first = clock.now() - milliseconds(10);
  sut->start(first, milliseconds(1));
  EXPECT_GE(sut->wait(), 11U);
}

TEST(LinuxClock, PeriodicTimerStaysOnItsGrid) {
  LinuxClock clock;
  const auto sut = clock.make_periodic_timer().value();
  const TimePoint first = clock.now() + milliseconds(2);
  sut->start(first, milliseconds(1));
  std::uint64_t went_off = 0;
  while (went_off < 20) {
    went_off += sut->wait();
    EXPECT_GE(clock.now(), first + (went_off - 1) * milliseconds(1));
  }
}

TEST(LinuxClock, PeriodicTimerCountsEachPeriodOnceHoweverLateItIsAskedFor) {
  LinuxClock clock;
  const auto sut = clock.make_periodic_timer().value();
  const TimePoint first = clock.now() + milliseconds(1);
  sut->start(first, microseconds(500));
  std::uint64_t went_off = 0;
  for (int i = 0; i < 40; ++i) {
    std::this_thread::sleep_for(microseconds(i * 97));
    // One that went off just now may come with the next call.
    const Duration since = clock.now() - first - microseconds(50);
    const auto least =
        since < Duration::zero() ? 0U : static_cast<std::uint64_t>(since / microseconds(500) + 1);
    went_off += sut->wait();
    ASSERT_GE(went_off, least);
    ASSERT_LE(went_off, static_cast<std::uint64_t>((clock.now() - first) / microseconds(500) + 1));
  }
}

TEST(LinuxClock, InterruptBeforeTheWaitIsNotLost) {
  LinuxClock clock;
  const auto sut = clock.make_periodic_timer().value();
  sut->interrupt();
  EXPECT_EQ(sut->wait(), 0U);
}

TEST(LinuxClock, InterruptEndsAWaitThatWouldLastForEver) {
  LinuxClock clock;
  const auto sut = clock.make_periodic_timer().value();
  for (int i = 0; i < 200; ++i) {
    sut->start(clock.now() + std::chrono::hours(1), std::chrono::hours(1));
    std::thread interrupter([&] { sut->interrupt(); });
    while (sut->wait() != 0) {
    }
    interrupter.join();
  }
}

TEST(LinuxClock, InterruptThatMeetsAStartEndsTheWaitAfterIt) {
  LinuxClock clock;
  const auto sut = clock.make_periodic_timer().value();
  for (int i = 0; i < 500; ++i) {
    std::atomic<bool> go{false};
    std::thread interrupter([&] {
      while (!go) {
      }
      sut->interrupt();
    });
    go = true;
    for (int spin = 0; spin < i * 10; ++spin) go.load();
    sut->start(clock.now() + std::chrono::hours(1), std::chrono::hours(1));
    while (sut->wait() != 0) {
    }
    interrupter.join();
  }
}

TEST(LinuxClock, TimerRunsOnAfterAnInterruptOnceItIsStartedAgain) {
  LinuxClock clock;
  const auto sut = clock.make_periodic_timer().value();
  sut->start(clock.now() + std::chrono::hours(1), std::chrono::hours(1));
  sut->interrupt();
  while (sut->wait() != 0) {
  }
  const TimePoint first = clock.now() + milliseconds(3);
  sut->start(first, milliseconds(1));
  EXPECT_GE(sut->wait(), 1U);
  EXPECT_GE(clock.now(), first);
}

TEST(ActivationGate, OpeningComesBeforeAnInterruptAndNeitherIsLost) {
  LinuxClock clock;
  ActivationGate sut;
  sut.interrupt(clock);
  EXPECT_TRUE(sut.open(clock));
  EXPECT_FALSE(sut.open(clock));
  EXPECT_EQ(sut.wait(clock), ActivationGate::Outcome::opened);
  EXPECT_EQ(sut.wait(clock), ActivationGate::Outcome::interrupted);
  EXPECT_EQ(sut.wait(clock, clock.now()), ActivationGate::Outcome::timed_out);
}

TEST(ActivationGate, WakesItsSleeperEachTime) {
  constexpr int kTimes = 20'000;
  LinuxClock clock;
  ActivationGate sut;
  std::atomic<int> passed{0};
  std::thread sleeper([&] {
    while (passed < kTimes) {
      if (sut.wait(clock) == ActivationGate::Outcome::opened) ++passed;
    }
  });
  for (int i = 0; i < kTimes; ++i) {
    sut.open(clock);
    while (passed <= i) std::this_thread::yield();
  }
  sleeper.join();
}

}  // namespace
}  // namespace plchost
