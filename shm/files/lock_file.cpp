#include "shm/files/lock_file.hpp"

#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace plchost {

namespace {

constexpr mode_t kOwnersMode = 0600;
constexpr mode_t kForOthersToWrite = S_IWGRP | S_IWOTH;

Result<void> check_ours(int fd, const std::string& path) {
  struct stat status{};
  if (::fstat(fd, &status) != 0) return failure(ErrorCode::system, "cannot examine " + path, errno);
  const bool trusted = status.st_uid == 0 || status.st_uid == ::geteuid();
  if (S_ISREG(status.st_mode) && trusted && (status.st_mode & kForOthersToWrite) == 0) return {};
  return failure(ErrorCode::refused,
                 fmt::format("{} is no lock file of this user: owner {}, mode {:04o}; remove it", path,
                             status.st_uid, status.st_mode & 07777U));
}

// In some folders the kernel refuses to open what is another user's, and a link or a folder at all.
ErrorCode code_of(int error) noexcept {
  const bool not_ours =
      error == EACCES || error == EPERM || error == ELOOP || error == EISDIR || error == ENXIO;
  return not_ours ? ErrorCode::refused : ErrorCode::system;
}

// Whether the file at `path` is still the one that is open: its last holder may have removed it meanwhile.
bool is_current(int fd, const std::string& path) {
  struct stat held{};
  struct stat named{};
  return ::fstat(fd, &held) == 0 && ::lstat(path.c_str(), &named) == 0 && held.st_ino == named.st_ino &&
         held.st_dev == named.st_dev;
}

struct flock whole_file() noexcept {
  struct flock lock{};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

std::string holder_of(int fd) {
  struct flock lock = whole_file();
  const bool known = ::fcntl(fd, F_GETLK, &lock) == 0 && lock.l_type != F_UNLCK && lock.l_pid > 0;
  return known ? fmt::format("process {}", lock.l_pid) : "another process";
}

}  // namespace

Result<LockFile> LockFile::take(const std::string& path) {
  for (;;) {
    // O_NONBLOCK: a FIFO would make the open wait.
    UniqueFd fd(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, kOwnersMode));
    if (!fd) {
      const int error = errno;
      return failure(code_of(error), "cannot open " + path, error);
    }
    PLCHOST_TRY(check_ours(fd.get(), path));
    struct flock lock = whole_file();
    if (::fcntl(fd.get(), F_SETLK, &lock) != 0) {
      const int error = errno;
      if (error != EAGAIN && error != EACCES) return failure(ErrorCode::system, "cannot lock " + path, error);
      return failure(ErrorCode::already_exists, fmt::format("{} holds {}", holder_of(fd.get()), path));
    }
    if (is_current(fd.get(), path)) return LockFile(std::move(fd), path);
  }
}

void LockFile::remove() noexcept {
  if (fd_) ::unlink(path_.c_str());
}

}  // namespace plchost
