#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "shm/base/counted_event.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

/// A kernel timer that goes off on a grid and counts by itself.
class PeriodicTimer {
 public:
  virtual ~PeriodicTimer() = default;
  /// Goes off at `first` (absolute; at once if that has passed) and then every `period` (> 0). Only the
  /// thread that waits. Real-time.
  virtual void start(TimePoint first, Duration period) noexcept = 0;
  /// Sleeps until it went off; how often since the last call. May return early: look at the clock. 0:
  /// interrupted; the timer has left its grid and is to be started again. Real-time.
  [[nodiscard]] virtual std::uint64_t wait() noexcept = 0;
  /// Makes wait() return 0, the one that sleeps now or the next one. Any thread.
  virtual void interrupt() noexcept = 0;
};

/// The seam between the schedulers and time: the real one is LinuxClock, tests drive a ManualClock.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual TimePoint now() const noexcept = 0;
  /// The processor time that the calling thread has used: without what others took from it. Real-time, a
  /// system call.
  [[nodiscard]] virtual Duration thread_time() const noexcept;
  /// Sleeps while `word` equals `expected`, at most until `deadline` (absolute; kNoDeadline: for ever). May
  /// return early: look again. Real-time.
  virtual void wait(const std::atomic<std::uint32_t>& word, std::uint32_t expected,
                    TimePoint deadline) noexcept = 0;
  /// Wakes the threads that sleep on `word`. Any context.
  virtual void wake(const std::atomic<std::uint32_t>& word) noexcept = 0;
  /// Burns the processor until `deadline`. Real-time; the caller bounds how far ahead that is.
  virtual void spin_until(TimePoint deadline) noexcept = 0;
  [[nodiscard]] virtual Result<std::unique_ptr<PeriodicTimer>> make_periodic_timer() = 0;
  /// Sleeps on the event's own word while it is as `seen`. May return early. Real-time.
  virtual void wait(CountedEvent& event, CountedEvent::Snapshot seen) noexcept = 0;

  /// A thread that sleeps by this clock is about to begin (called by the thread that starts it), or ends (by
  /// itself). Only a clock that is driven by hand needs to know.
  virtual void thread_begins() noexcept {}
  virtual void thread_ends() noexcept {}
};

/// CLOCK_MONOTONIC, futexes private to the process, and pairs of timerfds.
class LinuxClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const noexcept override { return MonotonicClock::now(); }
  void wait(const std::atomic<std::uint32_t>& word, std::uint32_t expected,
            TimePoint deadline) noexcept override;
  void wake(const std::atomic<std::uint32_t>& word) noexcept override;
  void wait(CountedEvent& event, CountedEvent::Snapshot seen) noexcept override { event.wait(seen); }
  void spin_until(TimePoint deadline) noexcept override;
  [[nodiscard]] Result<std::unique_ptr<PeriodicTimer>> make_periodic_timer() override;
};

/// Thread::start for a thread that sleeps by `clock`: tells the clock, lets the thread wake without slack,
/// and gives it a stack for its signals. Set-up.
[[nodiscard]] Result<Thread> start_clock_thread(Clock& clock, const std::string& name,
                                                ThreadPriority priority, std::function<void()> body);

}  // namespace plchost
