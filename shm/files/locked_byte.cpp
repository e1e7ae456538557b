#include "shm/files/locked_byte.hpp"

#include <algorithm>

#include <fcntl.h>

namespace plchost {

namespace {

struct flock lock_of(std::uint32_t byte, short type) noexcept {
  struct flock lock{};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  lock.l_start = static_cast<off_t>(byte);
  lock.l_len = 1;
  return lock;
}

}  // namespace

bool lock_byte(int fd, std::uint32_t byte) noexcept {
  struct flock lock = lock_of(byte, F_WRLCK);
  return ::fcntl(fd, F_SETLK, &lock) == 0;
}

void unlock_byte(int fd, std::uint32_t byte) noexcept {
  struct flock lock = lock_of(byte, F_UNLCK);
  (void)::fcntl(fd, F_SETLK, &lock);
}

// Asked as the owner of an open file, so that the kernel also tells a lock of this process.
std::optional<ByteHolder> holder_of_byte(int fd, std::uint32_t byte) noexcept {
  struct flock lock = lock_of(byte, F_WRLCK);
  if (::fcntl(fd, F_OFD_GETLK, &lock) != 0) return ByteHolder{};
  if (lock.l_type == F_UNLCK) return std::nullopt;
  return ByteHolder{.pid = std::max(lock.l_pid, 0)};
}

}  // namespace plchost
