#include "shm/base/futex.hpp"

#include <algorithm>
#include <cerrno>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace plchost {

FutexResult futex_wait(const void* word, std::uint32_t expected, TimePoint deadline) noexcept {
  const timespec until = to_timespec(std::max(deadline, TimePoint{}));  // the kernel refuses negative times
  // FUTEX_WAIT_BITSET, because its timeout is absolute; FUTEX_WAIT's is relative and drifts.
  const long returned =
      ::syscall(SYS_futex, word, FUTEX_WAIT_BITSET, expected, deadline == kNoDeadline ? nullptr : &until,
                nullptr, FUTEX_BITSET_MATCH_ANY);
  if (returned == 0 || errno == EINTR) return FutexResult::woken;
  return errno == ETIMEDOUT ? FutexResult::timed_out : FutexResult::changed;
}

int futex_wake(const void* word, int count) noexcept {
  const long woken = ::syscall(SYS_futex, word, FUTEX_WAKE, count, nullptr, nullptr, 0);
  return woken > 0 ? static_cast<int>(woken) : 0;
}

}  // namespace plchost
