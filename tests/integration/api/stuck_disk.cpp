// Loaded with LD_PRELOAD: while the file $STUCK_DISK is there, the audit log can neither be opened nor
// written: both hang, as on a file system that is frozen. With $STUCK_PATH, all paths with that text cannot
// be opened.
#include <array>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

bool is_of_audit_log(int fd) {
  std::array<char, 32> link{};
  std::array<char, 512> path{};
  (void)std::snprintf(link.data(), link.size(), "/proc/self/fd/%d", fd);
  return ::readlink(link.data(), path.data(), path.size() - 1) > 0 &&
         std::strstr(path.data(), "/audit.0") != nullptr;
}

void wait_for_disk() {
  const char* const flag = std::getenv("STUCK_DISK");  // NOLINT(concurrency-mt-unsafe): never changed
  while (flag != nullptr && ::access(flag, F_OK) == 0) ::usleep(1000);
}

}  // namespace

extern "C" __attribute__((visibility("default"))) ssize_t write(int fd, const void* bytes, size_t size) {
  if (is_of_audit_log(fd)) wait_for_disk();
  return ::syscall(SYS_write, fd, bytes, size);
}

// NOLINTNEXTLINE(cert-dcl50-cpp): the C library's own form
extern "C" __attribute__((visibility("default"))) int open(const char* path, int flags, ...) {
  const char* const stuck = std::getenv("STUCK_PATH");  // NOLINT(concurrency-mt-unsafe): never changed
  if (std::strstr(path, stuck != nullptr ? stuck : "/audit") != nullptr) wait_for_disk();
  mode_t mode = 0;
  if ((flags & O_CREAT) != 0) {
    std::va_list rest;
    va_start(rest, flags);
    mode = va_arg(rest, mode_t);
    va_end(rest);
  }
  return static_cast<int>(::syscall(SYS_openat, AT_FDCWD, path, flags, mode));
}
