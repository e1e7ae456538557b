#pragma once

#include <cstdint>
#include <optional>

#include <sys/types.h>

namespace plchost {

// Locks of single bytes of an open file (fcntl(2), F_SETLK): how processes of several PID namespaces see that
// one of them runs. The kernel gives a lock back at every end of its process, at exec(), and when the process
// closes any descriptor of that file. A child of fork() does not have it. Set-up: one system call each.

/// False: another process has it, or the file was not opened to be written.
[[nodiscard]] bool lock_byte(int fd, std::uint32_t byte) noexcept;
void unlock_byte(int fd, std::uint32_t byte) noexcept;

/// Of a byte that some process has locked, the caller too.
struct ByteHolder {
  pid_t pid = 0;  ///< in the PID namespace of the caller; 0: it has none there
};
/// Nothing: it is not locked. In doubt it is.
[[nodiscard]] std::optional<ByteHolder> holder_of_byte(int fd, std::uint32_t byte) noexcept;

}  // namespace plchost
