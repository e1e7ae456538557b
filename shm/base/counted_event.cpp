#include "shm/base/counted_event.hpp"

namespace plchost {

FutexResult CountedEvent::wait(Snapshot seen, TimePoint deadline) noexcept {
  std::uint64_t expected = seen.state_;
  const std::uint64_t announced = next_turn(expected) | kWaiter;
  // Announce the waiter only if nothing happened since the snapshot.
  if (!state_.compare_exchange_strong(expected, announced, std::memory_order_acq_rel,
                                      std::memory_order_acquire)) {
    return FutexResult::changed;
  }
  return futex_wait(&state_, static_cast<std::uint32_t>(announced), deadline);
}

void CountedEvent::wake(std::uint64_t made) noexcept {
  futex_wake(&state_);
  // Fails if anybody announced, posted or nudged since: then the flag stays for the next one to clear.
  state_.compare_exchange_strong(made, made & ~kWaiter, std::memory_order_acq_rel, std::memory_order_relaxed);
}

void CountedEvent::nudge() noexcept {
  std::uint64_t before = state_.load(std::memory_order_relaxed);
  while (!state_.compare_exchange_weak(before, next_turn(before), std::memory_order_acq_rel,
                                       std::memory_order_relaxed)) {
  }
  wake(next_turn(before));
}

}  // namespace plchost
