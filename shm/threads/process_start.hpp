#pragma once

#include <cstdint>
#include <optional>

#include <sys/types.h>

namespace plchost {

/// When a process began, in clock ticks since the host's start (proc(5), "starttime"; never 0).
/// Number and start together name it for good, the number alone is given to another one some day. The caller
/// is in the same PID namespace. Nothing: it has ended (a zombie has, too). Set-up: reads a file.
[[nodiscard]] std::optional<std::uint64_t> start_of(pid_t process) noexcept;

/// Identifies a process for good, and the program in it: exec() leaves number and start as they are.
struct ProcessIdentity {
  pid_t pid = 0;
  /// Made from where the host has put the program's code and stack; 0: not known. Two programs that follow
  /// one another in a process have the same if the host puts all at the same place (no address
  /// randomisation).
  std::uint32_t image = 0;
  /// It began then or earlier: a process that has no descriptor left cannot read when it began, and writes
  /// the time of its look.
  std::uint64_t start = 0;

  bool operator==(const ProcessIdentity&) const = default;
};
/// The calling process. Set-up: reads a file.
[[nodiscard]] ProcessIdentity this_process() noexcept;

/// The PID namespace of the calling process: the number N that the kernel shows as "pid:[N]". Processes of
/// another one have other numbers for the same process. 0: not known, there is no /proc. Set-up.
[[nodiscard]] std::uint64_t pid_namespace() noexcept;

/// How closely a process is looked at.
enum class ProcessLook : std::uint8_t {
  quick,     ///< its number alone: one system call
  thorough,  ///< also for a zombie, a number that was given again, and another program: reads a file
};
/// Whether the process has ended, or has another program by now. In doubt (the host hides it, as it does the
/// image of other users' processes) it has not. Set-up.
[[nodiscard]] bool process_has_ended(const ProcessIdentity& process,
                                     ProcessLook look = ProcessLook::thorough) noexcept;

/// A thread as others see it.
struct ThreadLook {
  std::uint64_t start = 0;  ///< 0: not known
  std::uint32_t image = 0;  ///< of its process, as above
  bool ending = false;      ///< it does not come back from the kernel any more
};
/// Nothing: it has ended, which it can do before its process does. Set-up.
[[nodiscard]] std::optional<ThreadLook> look_at_thread(pid_t thread) noexcept;

/// The calling thread. The first call of a thread reads a file, later ones cost nothing; a child of fork()
/// reads it anew.
struct ThreadIdentity {
  std::uint32_t id = 0;
  std::uint64_t start = 0;  ///< then or earlier, as above
  std::uint32_t image = 0;
};
[[nodiscard]] const ThreadIdentity& this_thread() noexcept;

}  // namespace plchost
