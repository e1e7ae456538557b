#pragma once

#include <atomic>
#include <bit>
#include <cstdint>

#include "shm/base/futex.hpp"

namespace plchost {

/// A counted event: a counter that only grows, and a futex word, in one 64-bit atomic. It may lie in
/// shared memory; all zero is a valid new event. Everything in it is lock-free and survives the death of
/// any user at any instruction.
///
///   63                          16 15     1 0
///   [ posts so far               ][ turns ][ waiter ]     low 32 bits are the futex word
///
/// Post is one atomic add, and at most one wake. Each waiter keeps a cursor of its own (how many posts it
/// has seen), so nothing is consumed by anyone else and the event needs no list of waiters. `waiter` says
/// that somebody may be asleep. Who wakes clears it afterwards, and only if the word is still the one that it
/// made itself: each waiter changes `turns` before it sleeps, so an unchanged word means that all sleepers
/// have been woken. A poster that dies at any point therefore leaves the flag set, never a sleeper without
/// it; a waiter that died costs one superfluous wake. A nudge changes `turns` too, without counting a post:
/// it wakes a thread that shall stop or change what it waits on.
class CountedEvent {
 public:
  /// The count begins anew at 0 after this.
  static constexpr std::uint64_t kCountMask = ~std::uint64_t{0} >> 16;

  /// One consistent view of the event.
  class Snapshot {
   public:
    /// Posts since the event was made.
    [[nodiscard]] std::uint64_t count() const noexcept { return state_ >> kCountShift; }

   private:
    friend class CountedEvent;
    explicit Snapshot(std::uint64_t state) noexcept : state_(state) {}
    std::uint64_t state_;
  };

  /// Any context, real-time included. Wakes every waiter if there may be one.
  void post() noexcept {
    // Release pairs with the acquire in snapshot(): what the poster wrote before is seen by the task.
    const std::uint64_t before = state_.fetch_add(kOnePost, std::memory_order_release);
    if ((before & kWaiter) != 0) wake(before + kOnePost);
  }

  [[nodiscard]] Snapshot snapshot() const noexcept {
    return Snapshot(state_.load(std::memory_order_acquire));
  }
  [[nodiscard]] std::uint64_t count() const noexcept { return snapshot().count(); }

  /// Sleeps until the event differs from `seen` or the deadline passes; may return early: look again.
  /// To stop a waiter without losing the wake: the waiter takes the snapshot, then looks at its stop flag,
  /// then waits; the stopper sets the flag, then nudges.
  FutexResult wait(Snapshot seen, TimePoint deadline = kNoDeadline) noexcept;

  /// The same where the event is mapped to read only: a post wakes it only if another one waits, too.
  FutexResult wait_unmarked(Snapshot seen, TimePoint deadline) const noexcept {
    return futex_wait(&state_, static_cast<std::uint32_t>(seen.state_), deadline);
  }

  /// Wakes all waiters without counting a post. Set-up and soft threads.
  void nudge() noexcept;

  /// Wakes the waiters that may be asleep, if there are any; changes neither count nor turns. A poster that
  /// ended between its add and its wake leaves a waiter asleep beside its post: this wakes it. Any context.
  void rouse() noexcept {
    const std::uint64_t state = state_.load(std::memory_order_acquire);
    if ((state & kWaiter) != 0) wake(state);
  }

 private:
  static constexpr std::uint64_t kWaiter = 1;
  static constexpr std::uint64_t kOneTurn = 2;
  static constexpr std::uint64_t kTurnMask = 0xfffe;
  static constexpr unsigned kCountShift = 16;
  static constexpr std::uint64_t kOnePost = std::uint64_t{1} << kCountShift;

  // The turns wrap inside their own bits; a carry would count as a post.
  [[nodiscard]] static constexpr std::uint64_t next_turn(std::uint64_t state) noexcept {
    return (state & ~kTurnMask) | ((state + kOneTurn) & kTurnMask);
  }
  void wake(std::uint64_t made) noexcept;

  std::atomic<std::uint64_t> state_{0};
};

static_assert(sizeof(CountedEvent) == 8 && std::atomic<std::uint64_t>::is_always_lock_free);
static_assert(std::endian::native == std::endian::little, "the futex word is the low half of the state");

}  // namespace plchost
