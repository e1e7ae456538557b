#include "shm/base/robust_mutex.hpp"

#include <algorithm>
#include <cerrno>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "shm/base/process_start.hpp"

namespace plchost {

namespace {

// A word that fits no state of the kernel's, seen so long, is not one that is just changing.
constexpr Duration kDoubt = std::chrono::milliseconds(80);
constexpr Duration kPause = std::chrono::milliseconds(1);

// The errno, 0 on success. FUTEX_LOCK_PI2 takes its time-out from CLOCK_MONOTONIC, FUTEX_LOCK_PI from the
// clock on the wall.
int lock_in_kernel(std::atomic<std::uint32_t>& word, TimePoint until) noexcept {
  const timespec at = to_timespec(std::max(until, TimePoint{}));
  return ::syscall(SYS_futex, &word, FUTEX_LOCK_PI2, 0, &at, nullptr, 0) == 0 ? 0 : errno;
}

void pause_until(TimePoint until) noexcept {
  const timespec at = to_timespec(until);
  ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr);
}

}  // namespace

LockResult RobustMutex::try_lock() noexcept {
  std::uint32_t found = 0;
  const ThreadIdentity& self = this_thread();
  if (word_.compare_exchange_strong(found, self.id, std::memory_order_acquire, std::memory_order_relaxed)) {
    owner_start_.store(self.start, std::memory_order_relaxed);
    return LockResult::locked;
  }
  // One that died may have had our number.
  const bool ours = (found & FUTEX_TID_MASK) == self.id && owner_start() == self.start;
  return ours ? LockResult::deadlock : LockResult::timed_out;
}

LockResult RobustMutex::lock(TimePoint deadline) noexcept {
  const LockResult at_once = try_lock();
  return at_once == LockResult::timed_out ? lock_slowly(deadline) : at_once;
}

LockResult RobustMutex::lock_slowly(TimePoint deadline) noexcept {
  const TimePoint began = MonotonicClock::now();
  unsigned refusals = 0;
  for (TimePoint now = began;;) {
    const int error = lock_in_kernel(word_, std::min(deadline, now + kLook));
    now = MonotonicClock::now();
    const bool long_enough = now - began > kDoubt;
    switch (error) {
      case 0:
        return taken();
      case EAGAIN:
      case EINTR:
        break;
      case EDEADLK:  // one that died had our number
      case ESRCH:
      case EPERM:  // its number belongs to a thread of the kernel now
      case ETIMEDOUT:
        if (take_over_from_the_dead(error == EDEADLK || long_enough)) return LockResult::owner_died;
        break;
      default:  // EINVAL: others still wait for a dead owner that it was taken over from, or it was scribbled
                // over
        if (++refusals > 1 && long_enough) return LockResult::corrupt;
    }
    if (now >= deadline) return LockResult::timed_out;
    if (error != EINTR && error != ETIMEDOUT) pause_until(std::min(deadline, now + kPause));
  }
}

// What is looked at twice is the same owner in the same hold: the start is cleared before the word at each
// unlock. If its owner died before it could tell its start, another thread of the same number is known from
// it only by time: `certain`.
bool RobustMutex::take_over_from_the_dead(bool certain) noexcept {
  const std::uint32_t word = word_.load(std::memory_order_acquire);
  const std::uint64_t start = owner_start_.load(std::memory_order_acquire);
  const auto thread = static_cast<pid_t>(word & FUTEX_TID_MASK);
  if (thread == 0) return false;
  if (!thread_has_ended(thread, start) && (start != 0 || !certain)) return false;
  return owner_start_.load(std::memory_order_acquire) == start && take_over(word);
}

// Only if it is still as it was seen. Who waits in the kernel for the dead one wakes at its next look.
bool RobustMutex::take_over(std::uint32_t word) noexcept {
  const std::uint32_t mine = this_thread().id | (word & FUTEX_WAITERS);
  if (!word_.compare_exchange_strong(word, mine, std::memory_order_acquire, std::memory_order_relaxed)) {
    return false;
  }
  owner_start_.store(this_thread().start, std::memory_order_relaxed);
  return true;
}

// By the kernel, which leaves the mark of a dead owner in the word for us to take off.
LockResult RobustMutex::taken() noexcept {
  const std::uint32_t before = word_.fetch_and(~std::uint32_t{FUTEX_OWNER_DIED}, std::memory_order_acquire);
  owner_start_.store(this_thread().start, std::memory_order_relaxed);
  return (before & FUTEX_OWNER_DIED) != 0 ? LockResult::owner_died : LockResult::locked;
}

bool RobustMutex::unlock() noexcept {
  const std::uint32_t self = this_thread().id;
  std::uint32_t word = word_.load(std::memory_order_relaxed);
  if ((word & FUTEX_TID_MASK) != self) return false;
  owner_start_.store(0, std::memory_order_relaxed);
  word = self;
  if (word_.compare_exchange_strong(word, 0, std::memory_order_release, std::memory_order_relaxed))
    return true;
  word_.fetch_or(
      0, std::memory_order_release);  // what was written before is seen by whom the kernel hands it to
  if (::syscall(SYS_futex, &word_, FUTEX_UNLOCK_PI, 0, nullptr, nullptr, 0) == 0) return true;
  // Those who wait do so for the dead one that it was taken over from; they look again within kLook.
  word_.store(0, std::memory_order_release);
  return true;
}

std::uint32_t RobustMutex::owner() const noexcept {
  return word_.load(std::memory_order_relaxed) & FUTEX_TID_MASK;
}

}  // namespace plchost
