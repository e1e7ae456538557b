#pragma once

#include <atomic>
#include <cstdint>

#include "shm/base/futex.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// A counting semaphore in one 32-bit word that may lie in shared memory; all zero is a valid one of value 0.
///
///   31        1 0
///   [ value   ][ waiter ]
///
/// `waiter` says that a thread may be asleep. A post takes the mark off in the same step in which it adds its
/// unit, and then wakes one thread. That thread takes its unit and sets the mark again, because others may be
/// asleep; if units are left, it wakes the next one. So the mark is never taken off by a thread that looked
/// at the word earlier.
///
/// A process that is killed loses no unit. If it is killed between a unit and the wake for it, the other
/// threads find the unit within kLook.
class CountingSemaphore {
 public:
  static constexpr std::uint32_t kMaxValue = 0x3fffffff;

  CountingSemaphore() noexcept = default;
  /// `value` <= kMaxValue.
  explicit CountingSemaphore(std::uint32_t value) noexcept : word_(value << 1) {}

  /// Adds one, and wakes one that waits. False, and nothing is done: it is at kMaxValue. Any context. No
  /// system call if nobody waits and nobody has slept since the last post.
  bool post() noexcept;
  /// Takes one if there is one. Any context.
  [[nodiscard]] bool try_wait() noexcept;
  /// Takes one; false: there was none until the deadline. No system call if there is one.
  [[nodiscard]] bool wait(TimePoint deadline = kNoDeadline) noexcept;
  [[nodiscard]] std::uint32_t value() const noexcept { return word_.load(std::memory_order_relaxed) / kOne; }

  static constexpr Duration kLook = std::chrono::milliseconds(40);

 private:
  static constexpr std::uint32_t kWaiter = 1;
  static constexpr std::uint32_t kOne = 2;

  [[nodiscard]] bool wait_asleep(TimePoint deadline) noexcept;

  std::atomic<std::uint32_t> word_{0};
};

static_assert(sizeof(CountingSemaphore) == 4);

}  // namespace plchost
