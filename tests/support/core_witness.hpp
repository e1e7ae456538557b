#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include <sched.h>
#include <time.h>

#include "shm/base/time.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

/// A bare thread on a core, above all priorities of instances. Only the machine holds it up: another guest,
/// or the kernel in a part that nobody may interrupt. Cycles that an instance loses there meanwhile are no
/// fault of plchost.
class CoreWitness {
 public:
  CoreWitness(int core, Duration interval) : saw_(std::make_unique<Saw>()) {
    constexpr int kAboveInstances = 95;
    auto started =
        Thread::start("witness", {.fifo = kAboveInstances, .nice = 0}, [core, interval, saw = saw_.get()] {
          cpu_set_t one;
          CPU_ZERO(&one);
          CPU_SET(static_cast<std::size_t>(core), &one);
          if (::sched_setaffinity(0, sizeof one, &one) == 0) watch(*saw, interval);
        });
    if (started) thread_ = *std::move(started);
  }
  CoreWitness(const CoreWitness&) = delete;
  CoreWitness& operator=(const CoreWitness&) = delete;
  ~CoreWitness() { saw_->enough = true; }

  /// At most so many cycles of that interval has the core taken so far. 0 for ever without the right to
  /// SCHED_FIFO.
  [[nodiscard]] std::uint64_t taken() const noexcept { return saw_->taken; }

 private:
  struct Saw {
    std::atomic<std::uint64_t> taken{0};
    std::atomic<bool> enough{false};
  };

  static void watch(Saw& saw, Duration interval) noexcept {
    constexpr Duration kPause = std::chrono::microseconds(200);
    for (TimePoint due = MonotonicClock::now() + kPause; !saw.enough; due = MonotonicClock::now() + kPause) {
      const timespec when = to_timespec(due);
      while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, nullptr) != 0) {
      }
      const Duration late = MonotonicClock::now() - due;
      // It may have been held up since its look before; and others catch up after a stall.
      if (late > kPause) saw.taken += static_cast<std::uint64_t>((late + kPause + interval / 2) / interval);
    }
  }

  std::unique_ptr<Saw> saw_;
  Thread thread_;  // joined before saw_ goes
};

}  // namespace plchost
