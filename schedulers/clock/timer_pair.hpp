#pragma once

#include <array>
#include <atomic>

#include "schedulers/clock/clock.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// Two timers of the kernel (timerfd) that go off in turn, each every second time. A read arms its timer anew
/// before it returns. A timer that is the next one of its core is written to the core's clock, which takes
/// microseconds, on a virtual machine most of all. Of two the other one is always next, so a thread is in its
/// code that much earlier. One system call per wait.
///
/// An interrupt makes both go off again and again. The thread that is told first waits until the timers are
/// not touched any more, so that a start after it is not undone.
class TimerPair final : public PeriodicTimer {
 public:
  TimerPair(UniqueFd first, UniqueFd second) noexcept;

  void start(TimePoint first, Duration period) noexcept override;
  [[nodiscard]] std::uint64_t wait() noexcept override;
  void interrupt() noexcept override;

 private:
  struct Half {
    UniqueFd fd;
    TimePoint due;  ///< goes off then, by its own count

    void arm(Duration first, Duration period, int flags) const noexcept;
    /// Sleeps until it went off; how often. 0: a signal came.
    [[nodiscard]] std::uint64_t read(Duration period) noexcept;
  };

  enum : std::uint32_t { kNone, kAsked, kDone };

  [[nodiscard]] bool take_interrupt() noexcept;
  [[nodiscard]] Half& next() noexcept { return halves_[1].due < halves_[0].due ? halves_[1] : halves_[0]; }
  [[nodiscard]] std::uint64_t went_off() noexcept;

  std::array<Half, 2> halves_;
  Duration period_{};  // of each: two of those that are asked for
  std::atomic<std::uint32_t> interrupt_{kNone};
};

}  // namespace plchost
