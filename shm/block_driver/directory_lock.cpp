#include "shm/block_driver/directory_lock.hpp"

#include <cerrno>
#include <chrono>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <time.h>

#include "shm/base/time.hpp"
#include "shm/files/memory_file.hpp"

namespace plchost {

namespace {

// The lock is held for a millisecond at most; but its holder may be stopped.
constexpr auto kLockPatience = std::chrono::seconds(5);
constexpr timespec kBetweenLooks{.tv_sec = 0, .tv_nsec = 200'000};

}  // namespace

Result<DirectoryLock> DirectoryLock::acquire(const std::string& name) {
  const std::string path = MemoryFile::path(name);
  UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (!fd) {
    const int error = errno;
    return failure(error == ENOENT ? ErrorCode::not_found : ErrorCode::system,
                   fmt::format("cannot open {}", path), error);
  }
  const TimePoint deadline = MonotonicClock::now() + kLockPatience;
  while (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
    const int error = errno;
    if (error != EWOULDBLOCK && error != EINTR) {
      return failure(ErrorCode::system, fmt::format("cannot lock {}", path), error);
    }
    if (MonotonicClock::now() >= deadline) {
      return failure(ErrorCode::timed_out,
                     fmt::format("another process holds the lock of {} for more than {} s", path,
                                 kLockPatience.count()));
    }
    ::clock_nanosleep(CLOCK_MONOTONIC, 0, &kBetweenLooks, nullptr);
  }
  return DirectoryLock(std::move(fd));
}

}  // namespace plchost
