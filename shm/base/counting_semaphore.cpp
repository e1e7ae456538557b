#include "shm/base/counting_semaphore.hpp"

#include <algorithm>

namespace plchost {

bool CountingSemaphore::post() noexcept {
  std::uint32_t before = word_.load(std::memory_order_relaxed);
  do {
    if (before / kOne >= kMaxValue) return false;
  } while (!word_.compare_exchange_weak(before, before + kOne, std::memory_order_release,
                                        std::memory_order_relaxed));
  if ((before & kWaiter) == 0) return true;
  // The mark goes when nobody sleeps any more, and only if nobody has come since.
  if (futex_wake(&word_, 1) == 0) {
    std::uint32_t made = before + kOne;
    word_.compare_exchange_strong(made, made & ~kWaiter, std::memory_order_release,
                                  std::memory_order_relaxed);
  }
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
  for (;;) {
    if (try_wait()) return true;
    std::uint32_t word = 0;
    // Fails if it is marked already, or has a unit now: then the sleep is refused, too.
    word_.compare_exchange_strong(word, kWaiter, std::memory_order_relaxed);
    const TimePoint now = MonotonicClock::now();
    if (now >= deadline) return false;
    futex_wait(&word_, kWaiter, std::min(deadline, now + kLook));
  }
}

}  // namespace plchost
