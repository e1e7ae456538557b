#include "shm/base/counted_event.hpp"

namespace plchost {

FutexResult CountedEvent::wait(Snapshot seen, TimePoint deadline) noexcept {
  std::uint64_t expected = seen.state_;
  if ((expected & kWaiter) == 0) {
    // Announce the waiter only if nothing happened since the snapshot.
    if (!state_.compare_exchange_strong(expected, expected | kWaiter, std::memory_order_acq_rel,
                                        std::memory_order_acquire)) {
      return FutexResult::changed;
    }
    expected |= kWaiter;
  }
  return futex_wait(&state_, static_cast<std::uint32_t>(expected), deadline);
}

void CountedEvent::wake() noexcept {
  // The flag goes first: a waiter that is between its announcement and its sleep then finds the word
  // changed and looks again.
  state_.fetch_and(~kWaiter, std::memory_order_acq_rel);
  futex_wake(&state_);
}

void CountedEvent::nudge() noexcept {
  std::uint64_t before = state_.load(std::memory_order_relaxed);
  std::uint64_t after = 0;
  do {
    // The nudges wrap inside their own bits; a carry would count as a post.
    after = (before & ~kNudgeMask) | ((before + kOneNudge) & kNudgeMask);
  } while (
      !state_.compare_exchange_weak(before, after, std::memory_order_acq_rel, std::memory_order_relaxed));
  wake();
}

}  // namespace plchost
