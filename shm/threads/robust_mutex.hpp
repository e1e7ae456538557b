#pragma once

#include <atomic>
#include <cstdint>

#include "shm/base/futex.hpp"
#include "shm/base/time.hpp"

namespace plchost {

enum class LockResult : std::uint8_t {
  locked,
  owner_died,  ///< locked; the one before ended while it held it: look at what it guards
  timed_out,
  deadlock,  ///< the calling thread holds it already
  corrupt,   ///< no mutex of this kind lies there
};

/// A mutex that may lie in shared memory: priority-inheriting, and robust against the end of its owner at any
/// instruction. All zero is a valid free one. Unlike the C library's it keeps no pointers in the memory, so
/// whatever a stranger writes into it can at worst make a lock fail.
///
/// The word is a PI futex: the owner's thread id, and flags that the kernel sets. If the owner ends while
/// others wait, the kernel hands the lock on and says so; if nobody waits, the next one finds a thread that
/// is not there. The record tells a thread that was given the same number later from the owner, and a program
/// that exec() has put in the place of the owner's. A waiter looks at it every kLook.
class RobustMutex {
 public:
  /// Not taken and not busy: no system call (a thread's first one reads a file). Any context; the deadline
  /// bounds it.
  [[nodiscard]] LockResult lock(TimePoint deadline = kNoDeadline) noexcept;
  /// timed_out: another thread holds it. The same, without waiting.
  [[nodiscard]] LockResult try_lock() noexcept;
  /// False, and nothing is done: the calling thread does not hold it. Any context.
  bool unlock() noexcept;
  /// The thread that holds it; 0: none. It may have ended since. Any context.
  [[nodiscard]] std::uint32_t owner() const noexcept;
  /// The thread that holds it has ended since, or will not come back from the kernel. Set-up; only reads.
  [[nodiscard]] bool owner_has_ended() const noexcept;
  /// Takes it from `thread`, which a stranger must have written there: it cannot reach this memory. False: it
  /// is not held by that thread (any more). Set-up.
  [[nodiscard]] bool take_from(std::uint32_t thread) noexcept;
  /// How long one that was left by a dead thread can look as if it were held.
  static constexpr Duration kLook = std::chrono::milliseconds(40);

 private:
  [[nodiscard]] LockResult lock_slowly(TimePoint deadline) noexcept;
  enum class OwnerState : std::uint8_t { alive, ending, gone };
  [[nodiscard]] OwnerState look_at_owner(std::uint32_t word, bool nobody_waits) const noexcept;
  void record() noexcept;
  [[nodiscard]] bool take_over(std::uint32_t word) noexcept;
  [[nodiscard]] LockResult taken() noexcept;

  std::atomic<std::uint32_t> word_{0};
  std::atomic<std::uint32_t> image_{0};  ///< of the owner's program; 0: not known. Written before the record
  /// [ start of the owner, its lower 34 bits ][ its number : 30 ]; 0: not held, or not told yet.
  std::atomic<std::uint64_t> record_{0};
};

static_assert(sizeof(RobustMutex) == 16);

}  // namespace plchost
