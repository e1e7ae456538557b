#include "shm/base/counting_semaphore.hpp"

#include <algorithm>

namespace plchost {

bool CountingSemaphore::post() noexcept {
  std::uint32_t before = word_.load(std::memory_order_relaxed);
  do {
    if (before / kOne >= kMaxValue) return false;
    // Release pairs with the acquire of the thread that takes the unit.
  } while (!word_.compare_exchange_weak(before, (before & ~kWaiter) + kOne, std::memory_order_release,
                                        std::memory_order_relaxed));
  if ((before & kWaiter) != 0) futex_wake(&word_, 1);
  return true;
}

bool CountingSemaphore::try_wait() noexcept {
  std::uint32_t word = word_.load(std::memory_order_relaxed);
  while (word >= kOne) {
    if (word_.compare_exchange_weak(word, word - kOne, std::memory_order_acquire,
                                    std::memory_order_relaxed)) {
      return true;
    }
  }
  return false;
}

bool CountingSemaphore::wait(TimePoint deadline) noexcept {
  return try_wait() || wait_asleep(deadline);
}

bool CountingSemaphore::wait_asleep(TimePoint deadline) noexcept {
  std::uint32_t mark = 0;  // of a thread that has slept: a post may have woken it instead of another one
  for (;;) {
    std::uint32_t word = word_.load(std::memory_order_relaxed);
    if (word >= kOne) {
      if (!word_.compare_exchange_weak(word, (word - kOne) | mark, std::memory_order_acquire,
                                       std::memory_order_relaxed)) {
        continue;
      }
      // Posts since the wake found no mark, so they woke nobody for the units that are left.
      if (mark != 0 && word - kOne >= kOne) futex_wake(&word_, 1);
      return true;
    }
    // A unit that has come meanwhile is looked at first, also if the deadline has passed.
    if (word == 0 && !word_.compare_exchange_strong(word, kWaiter, std::memory_order_relaxed)) continue;
    const TimePoint now = MonotonicClock::now();
    if (now >= deadline) return false;
    futex_wait(&word_, kWaiter, std::min(deadline, now + kLook));
    mark = kWaiter;
  }
}

}  // namespace plchost
