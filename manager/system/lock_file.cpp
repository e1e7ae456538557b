#include "manager/system/lock_file.hpp"

#include <array>
#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"

namespace plchost {

namespace {

// Whether the file at `path` is still the one that is open: its last holder may have removed it meanwhile.
bool is_current(int fd, const std::string& path) {
  struct stat held{};
  struct stat named{};
  return ::fstat(fd, &held) == 0 && ::stat(path.c_str(), &named) == 0 && held.st_ino == named.st_ino &&
         held.st_dev == named.st_dev;
}

std::string holder_of(int fd) {
  std::array<char, 16> text{};
  const ssize_t length = ::pread(fd, text.data(), text.size() - 1, 0);
  return length > 0 ? std::string(text.data(), static_cast<std::size_t>(length)) : "unknown";
}

}  // namespace

Result<LockFile> LockFile::take(const std::string& path) {
  for (;;) {
    constexpr mode_t kMode = 0640;
    auto opened =
        check_errno(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kMode), "open " + path);
    if (!opened) return std::unexpected(opened.error());
    UniqueFd fd(*opened);
    if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
      if (errno != EWOULDBLOCK) return failure(ErrorCode::system, "lock " + path, errno);
      return failure(ErrorCode::already_exists,
                     fmt::format("another manager runs with this run directory: process {} holds {}",
                                 holder_of(fd.get()), path));
    }
    if (!is_current(fd.get(), path)) continue;
    const std::string pid = fmt::format("{}", ::getpid());
    if (::ftruncate(fd.get(), 0) != 0 || ::pwrite(fd.get(), pid.data(), pid.size(), 0) < 0) {
      return failure(ErrorCode::system, "write " + path, errno);
    }
    return LockFile(std::move(fd), path);
  }
}

void LockFile::remove() noexcept {
  if (fd_) ::unlink(path_.c_str());
}

void notify_service_manager(const char* state) noexcept {
  ::sd_notify(0, state);
}

}  // namespace plchost
