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
///   63                   16 15     14      13    1 0
///   [ posts so far        ][ mark ][ taken ][ turns ][ waiter ]     low 32 bits are the futex word
///
/// Post is one atomic add, and at most one wake. Each waiter keeps a cursor of its own (how many posts it
/// has seen), so nothing is consumed by anyone else and the event needs no list of waiters. `waiter` says
/// that somebody may be asleep. The waker clears it afterwards, and only if the word is still the one that it
/// made itself. Each waiter changes `turns` before it sleeps, so an unchanged word means that all sleepers
/// have been woken. A poster that ends at any point therefore leaves the flag set, never a sleeper without
/// it; a waiter that ended costs one superfluous wake. A nudge changes `turns` too, without counting a post:
/// it wakes a thread that shall stop or change what it waits on.
///
/// `taken` says that tasks run for posts. It changes in the same word that counts, so each post is before or
/// after the change, and its poster is told on which side. `mark` changes with each marked post, in the same
/// step. One poster at a time makes marked posts. If it is killed, the mark tells whether its last one was
/// made, however many others were made beside it.
class CountedEvent {
 public:
  /// The count begins anew at 0 after this.
  static constexpr std::uint64_t kCountMask = ~std::uint64_t{0} >> 16;

  /// One consistent view of the event.
  class Snapshot {
   public:
    /// Posts since the event was made.
    [[nodiscard]] std::uint64_t count() const noexcept { return state_ >> kCountShift; }
    [[nodiscard]] bool taken() const noexcept { return (state_ & kTaken) != 0; }
    [[nodiscard]] bool marked() const noexcept { return (state_ & kMark) != 0; }

   private:
    friend class CountedEvent;
    explicit Snapshot(std::uint64_t state) noexcept : state_(state) {}
    std::uint64_t state_;
  };

  /// Any context, real-time included. Wakes every waiter if there may be one. False: the post is counted, but
  /// no task took posts at that moment.
  bool post() noexcept {
    // Release pairs with the acquire in snapshot(): the task sees all that the poster wrote before.
    const std::uint64_t before = state_.fetch_add(kOnePost, std::memory_order_release);
    if ((before & kWaiter) != 0) wake(before + kOnePost);
    return (before & kTaken) != 0;
  }

  /// One post that changes the mark, if the event is still as `seen`, which then becomes what the post made
  /// of it. False: the event has changed, and nothing was done. Wakes nobody: wake() comes next.
  [[nodiscard]] bool post_marked(Snapshot& seen) noexcept {
    std::uint64_t before = seen.state_;
    const std::uint64_t made = (before + kOnePost) ^ kMark;
    const bool done =
        state_.compare_exchange_strong(before, made, std::memory_order_acq_rel, std::memory_order_relaxed);
    if (done) seen.state_ = made;
    return done;
  }
  /// Wakes every waiter, if there may be one, for the post that made the event as `made`.
  void wake(Snapshot made) noexcept {
    if ((made.state_ & kWaiter) != 0) wake(made.state_);
  }

  /// Whether tasks run for the posts after this. Returns the event as it was at that moment. Set-up.
  Snapshot set_taken(bool taken) noexcept {
    return Snapshot(taken ? state_.fetch_or(kTaken, std::memory_order_acq_rel)
                          : state_.fetch_and(~kTaken, std::memory_order_acq_rel));
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
  static constexpr std::uint64_t kTurnMask = 0x3ffe;
  static constexpr std::uint64_t kTaken = 1U << 14;
  static constexpr std::uint64_t kMark = 1U << 15;
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
