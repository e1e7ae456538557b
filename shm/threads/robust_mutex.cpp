#include "shm/threads/robust_mutex.hpp"

#include <algorithm>
#include <cerrno>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "shm/threads/process_start.hpp"

namespace plchost {

namespace {

// A word that fits no state of the kernel's, seen so long, is not one that is just changing.
constexpr Duration kDoubt = std::chrono::milliseconds(80);
constexpr Duration kPause = std::chrono::milliseconds(1);

constexpr unsigned kNumberBits = 30;
static_assert(FUTEX_TID_MASK == (1U << kNumberBits) - 1);

constexpr std::uint64_t record_of(const ThreadIdentity& thread) noexcept {
  return thread.start << kNumberBits | thread.id;
}

// Whether a thread that began at `start` began after the one of this record: it has its number only. A record
// says when its thread began or a time after that, so a living owner is never later. Of the start the record
// has the lower bits.
constexpr bool began_later(std::uint64_t start, std::uint64_t record) noexcept {
  constexpr std::uint64_t kHalf = std::uint64_t{1} << (63 - kNumberBits);
  const std::uint64_t after = (start - (record >> kNumberBits)) & (2 * kHalf - 1);
  return after != 0 && after < kHalf;
}

/// Of a word or a record.
constexpr std::uint32_t number_of(std::uint64_t value) noexcept {
  return static_cast<std::uint32_t>(value) & FUTEX_TID_MASK;
}

// The errno, 0 on success. FUTEX_LOCK_PI2 takes its timeout from CLOCK_MONOTONIC, FUTEX_LOCK_PI from the
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

void RobustMutex::record() noexcept {
  const ThreadIdentity& self = this_thread();
  image_.store(self.image, std::memory_order_relaxed);
  record_.store(record_of(self), std::memory_order_release);
}

LockResult RobustMutex::try_lock() noexcept {
  std::uint32_t found = 0;
  const ThreadIdentity& self = this_thread();
  if (word_.compare_exchange_strong(found, self.id, std::memory_order_acquire, std::memory_order_relaxed)) {
    image_.store(self.image, std::memory_order_relaxed);
    record_.store(record_of(self), std::memory_order_release);
    return LockResult::locked;
  }
  // One that ended may have had our number, or this program may have come by exec() into the owner's place.
  const bool ours = number_of(found) == self.id &&
                    record_.load(std::memory_order_acquire) == record_of(self) &&
                    image_.load(std::memory_order_relaxed) == self.image;
  return ours ? LockResult::deadlock : LockResult::timed_out;
}

LockResult RobustMutex::lock(TimePoint deadline) noexcept {
  const LockResult at_once = try_lock();
  return at_once == LockResult::timed_out ? lock_slowly(deadline) : at_once;
}

LockResult RobustMutex::lock_slowly(TimePoint deadline) noexcept {
  TimePoint now = MonotonicClock::now();
  TimePoint doubtful_since = kNoDeadline;
  std::uint32_t ending = 0;  // an owner that was seen to end before the kernel was asked
  for (;;) {
    const std::uint32_t before = word_.load(std::memory_order_acquire);
    const int error = lock_in_kernel(word_, std::min(deadline, now + kLook));
    now = MonotonicClock::now();
    doubtful_since = error == EINVAL ? std::min(doubtful_since, now) : kNoDeadline;
    bool again = error == EINTR || error == ETIMEDOUT;
    switch (error) {
      case 0:
        return taken();
      case EDEADLK:  // one that ended had our number
        if (number_of(before) == this_thread().id && take_over(before)) return LockResult::owner_died;
        break;
      case ESRCH:  // there is no such thread, or it is past what it does about its futexes when it ends
        if (ending != 0 && ending == number_of(before) && take_over(before)) return LockResult::owner_died;
        [[fallthrough]];
      case EPERM:  // its number belongs to a thread of the kernel now
      case ETIMEDOUT: {
        const std::uint32_t word = word_.load(std::memory_order_acquire);
        const OwnerState owner = look_at_owner(word, error == ESRCH);
        if (owner == OwnerState::gone && take_over(word)) return LockResult::owner_died;
        ending = owner == OwnerState::ending ? number_of(word) : 0;
        again = again || ending != 0;
        break;
      }
      case EINVAL:  // others still wait for a dead owner that it was taken over from, or it was scribbled
                    // over
        if (now - doubtful_since > kDoubt) return LockResult::corrupt;
        break;
      default:  // EAGAIN: its owner is just ending; EINTR
        break;
    }
    if (now >= deadline) return LockResult::timed_out;
    if (!again) pause_until(std::min(deadline, now + kPause));
  }
}

// An owner is gone if its thread is not there, or if the thread of that number began later than the owner or
// runs another program now. A record of another number proves nothing, because each owner clears its own
// record before it unlocks. The kernel hands over the mutex of an ended owner. A running owner keeps it,
// however long it takes to write its record.
//
// The end of a large process takes long. An owner that is ending counts as gone if the kernel, asked after
// that was seen, knows no waiter to hand the mutex to.
RobustMutex::OwnerState RobustMutex::look_at_owner(std::uint32_t word, bool nobody_waits) const noexcept {
  const std::uint64_t record = record_.load(std::memory_order_acquire);
  const std::uint32_t image = image_.load(std::memory_order_relaxed);
  const std::uint32_t owner = number_of(word);
  if (owner == 0) return OwnerState::alive;
  const auto look = look_at_thread(static_cast<pid_t>(owner));
  const bool same = record_.load(std::memory_order_acquire) == record;
  if (!look) return nobody_waits && same ? OwnerState::gone : OwnerState::alive;
  const bool told = number_of(record) == owner && same;
  const bool later = look->start != 0 && began_later(look->start, record);
  const bool another = look->image != 0 && image != 0 && look->image != image;
  if (told && (later || another)) return OwnerState::gone;
  return look->ending ? OwnerState::ending : OwnerState::alive;
}

// Only if it is still as it was seen. A thread that waits in the kernel for the dead one wakes at its next
// look.
bool RobustMutex::take_over(std::uint32_t word) noexcept {
  const std::uint32_t mine = this_thread().id | (word & FUTEX_WAITERS);
  if (!word_.compare_exchange_strong(word, mine, std::memory_order_acquire, std::memory_order_relaxed)) {
    return false;
  }
  record();
  return true;
}

bool RobustMutex::take_from(std::uint32_t thread) noexcept {
  const std::uint32_t word = word_.load(std::memory_order_acquire);
  return number_of(word) == thread && take_over(word);
}

// By the kernel, which leaves the mark of a dead owner in the word for us to take off.
LockResult RobustMutex::taken() noexcept {
  const std::uint32_t before = word_.fetch_and(~std::uint32_t{FUTEX_OWNER_DIED}, std::memory_order_acquire);
  record();
  return (before & FUTEX_OWNER_DIED) != 0 ? LockResult::owner_died : LockResult::locked;
}

bool RobustMutex::unlock() noexcept {
  const std::uint32_t self = this_thread().id;
  std::uint32_t word = word_.load(std::memory_order_relaxed);
  if (number_of(word) != self) return false;
  record_.store(0, std::memory_order_release);
  word = self;
  if (word_.compare_exchange_strong(word, 0, std::memory_order_release, std::memory_order_relaxed))
    return true;
  word_.fetch_or(0, std::memory_order_release);  // the thread that the kernel hands it to sees all that was
                                                 // written before
  if (::syscall(SYS_futex, &word_, FUTEX_UNLOCK_PI, 0, nullptr, nullptr, 0) == 0) return true;
  // Those who wait do so for the dead one that it was taken over from; they look again within kLook.
  word_.store(0, std::memory_order_release);
  return true;
}

std::uint32_t RobustMutex::owner() const noexcept {
  return number_of(word_.load(std::memory_order_relaxed));
}

bool RobustMutex::owner_has_ended() const noexcept {
  const std::uint32_t word = word_.load(std::memory_order_acquire);
  if (number_of(word) == 0) return false;
  return (word & FUTEX_OWNER_DIED) != 0 || look_at_owner(word, true) != OwnerState::alive;
}

}  // namespace plchost
