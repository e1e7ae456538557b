#pragma once

#include <atomic>
#include <cstdint>

#include "schedulers/clock/clock.hpp"

namespace plchost {

/// One futex word on which one thread sleeps and which others open. Opening takes at most one system call,
/// and there is no way back ("done"): the thread that opens never waits.
class ActivationGate {
 public:
  enum class Outcome : std::uint8_t { opened, interrupted, timed_out };

  /// Sleeps until the gate is open, and closes it. An open gate comes before an interrupt. Real-time; one
  /// thread.
  [[nodiscard]] Outcome wait(Clock& clock, TimePoint deadline = kNoDeadline) noexcept {
    for (;;) {
      const std::uint32_t state = word_.load(std::memory_order_acquire);
      if ((state & kOpen) != 0) {
        word_.fetch_and(~kOpen, std::memory_order_acq_rel);
        return Outcome::opened;
      }
      if ((state & kInterrupt) != 0) {
        word_.fetch_and(~kInterrupt, std::memory_order_acq_rel);
        return Outcome::interrupted;
      }
      if (deadline != kNoDeadline && clock.now() >= deadline) return Outcome::timed_out;
      clock.wait(word_, state, deadline);
    }
  }

  /// Sleeps until the gate is open, and closes it; an interrupt stays for the next wait(). For a caller that
  /// knows that it is about to be opened. Real-time; the thread that waits.
  void pass(Clock& clock) noexcept {
    std::uint32_t state = word_.load(std::memory_order_acquire);
    for (; (state & kOpen) == 0; state = word_.load(std::memory_order_acquire)) {
      clock.wait(word_, state, kNoDeadline);
    }
    word_.fetch_and(~kOpen, std::memory_order_acq_rel);
  }

  /// false: it was open already. Any thread, real-time.
  bool open(Clock& clock) noexcept { return raise(clock, kOpen); }
  void interrupt(Clock& clock) noexcept { raise(clock, kInterrupt); }
  /// Forgets an opening that nobody took. Only while nobody waits or opens.
  void close() noexcept { word_.fetch_and(~kOpen, std::memory_order_acq_rel); }

 private:
  static constexpr std::uint32_t kOpen = 1;
  static constexpr std::uint32_t kInterrupt = 2;

  // Always a read-modify-write, also if the flag is up already: the thread that closes the gate then sees all
  // that was written before it was opened.
  bool raise(Clock& clock, std::uint32_t flag) noexcept {
    if ((word_.fetch_or(flag, std::memory_order_acq_rel) & flag) != 0) return false;
    clock.wake(word_);
    return true;
  }

  std::atomic<std::uint32_t> word_{0};
};

}  // namespace plchost
