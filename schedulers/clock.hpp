#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// A kernel timer that goes off on a grid and counts by itself.
class PeriodicTimer {
 public:
  virtual ~PeriodicTimer() = default;
  /// Goes off at `first` (absolute) and then every `period`. Set-up, or the thread that waits.
  [[nodiscard]] virtual Result<void> start(TimePoint first, Duration period) = 0;
  /// Sleeps until it went off; how often since the last call. 0: interrupted. Real-time.
  [[nodiscard]] virtual std::uint64_t wait() noexcept = 0;
  /// Makes wait() return 0, the one that sleeps now or the next one. Any thread.
  virtual void interrupt() noexcept = 0;
};

/// The seam between the schedulers and time: the real one is LinuxClock, tests drive a ManualClock.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual TimePoint now() const noexcept = 0;
  /// Sleeps while `word` equals `expected`, at most until `deadline` (absolute; kNoDeadline: for ever). May
  /// return early: look again. Real-time.
  virtual void wait(const std::atomic<std::uint32_t>& word, std::uint32_t expected,
                    TimePoint deadline) noexcept = 0;
  /// Wakes the threads that sleep on `word`. Any context.
  virtual void wake(const std::atomic<std::uint32_t>& word) noexcept = 0;
  /// Burns the processor until `deadline`. Real-time; the caller bounds how far ahead that is.
  virtual void spin_until(TimePoint deadline) noexcept = 0;
  [[nodiscard]] virtual Result<std::unique_ptr<PeriodicTimer>> make_periodic_timer() = 0;
};

/// CLOCK_MONOTONIC, futexes and timerfd.
class LinuxClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const noexcept override { return MonotonicClock::now(); }
  void wait(const std::atomic<std::uint32_t>& word, std::uint32_t expected,
            TimePoint deadline) noexcept override;
  void wake(const std::atomic<std::uint32_t>& word) noexcept override;
  void spin_until(TimePoint deadline) noexcept override;
  [[nodiscard]] Result<std::unique_ptr<PeriodicTimer>> make_periodic_timer() override;
};

}  // namespace plchost
