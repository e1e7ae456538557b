#pragma once

#include <cstdint>
#include <optional>

#include <sys/types.h>

namespace plchost {

/// When a process began, in clock ticks since the host's start (proc(5), "starttime"; never 0).
/// Number and start together name it for good, the number alone is given to another one some day. Who looks
/// is in the same PID namespace. Nothing: it has ended (a zombie has, too). Set-up: reads a file.
[[nodiscard]] std::optional<std::uint64_t> start_of(pid_t process) noexcept;

/// Whether the process that began at `start` has ended. In doubt (the host hides it) it has not. Set-up.
[[nodiscard]] bool process_has_ended(pid_t process, std::uint64_t start) noexcept;
/// When a thread began; nothing: it has ended, which it can do before its process does. In doubt it is there,
/// with the start 0. Set-up.
[[nodiscard]] std::optional<std::uint64_t> start_of_thread(pid_t thread) noexcept;

/// The calling thread. The first call of a thread reads a file, later ones cost nothing; a child of fork()
/// reads it anew.
struct ThreadIdentity {
  std::uint32_t id = 0;
  std::uint64_t start = 0;
};
[[nodiscard]] const ThreadIdentity& this_thread() noexcept;

}  // namespace plchost
