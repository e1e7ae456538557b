// Loaded into plchost-dds with LD_PRELOAD: while the file $STUCK_DISK is there, what is written to the audit
// log hangs, as on a file system that is frozen.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>

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

}  // namespace

extern "C" __attribute__((visibility("default"))) ssize_t write(int fd, const void* bytes, size_t size) {
  const char* const flag = std::getenv("STUCK_DISK");  // NOLINT(concurrency-mt-unsafe): never changed
  while (flag != nullptr && is_of_audit_log(fd) && ::access(flag, F_OK) == 0) ::usleep(1000);
  return ::syscall(SYS_write, fd, bytes, size);
}
