#pragma once

#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/sockets/packet_socket.hpp"

namespace plchost {

/// How a process ended.
struct ExitStatus {
  enum class Kind : bool { exited, killed };
  Kind kind = Kind::exited;
  int value = 0;               ///< exit code, or number of the signal
  bool known = true;           ///< false: it was no child of this manager
  bool out_of_memory = false;  ///< the kernel has ended it, or another of its group, for that
  [[nodiscard]] bool exited_with(int code) const noexcept {
    return known && kind == Kind::exited && value == code;
  }
  [[nodiscard]] bool success() const noexcept { return exited_with(0); }
  /// "exit code 3", "killed by SIGSEGV"
  [[nodiscard]] std::string describe() const;
};

/// A process, held by its pidfd: a number that cannot come to mean another process.
struct ChildProcess {
  pid_t pid = 0;
  UniqueFd pidfd;
};

/// In the child, the report channel is this descriptor.
inline constexpr int kChildReportFd = 3;

struct SpawnRequest {
  std::vector<std::string> arguments;  ///< the program's path first
  int report_fd = -1;                  ///< becomes kChildReportFd; -1: none
  int output_fd = -1;                  ///< becomes standard output and error; -1: the manager's own
};

/// Starts a program in a session of its own, with no other descriptor of ours, default signals (SIGPIPE as in
/// this one), nothing blocked, and standard input from /dev/null. It does not end when the manager does.
/// Small and quick: posix_spawn.
[[nodiscard]] Result<ChildProcess> spawn_process(const SpawnRequest& request);

/// A process that somebody else started.
[[nodiscard]] Result<ChildProcess> open_process(pid_t pid);

/// The end of a process whose pidfd is readable.
[[nodiscard]] ExitStatus reap_process(const ChildProcess& process);

/// Of a process that has ended, and, if it was a child, was not reaped: SIGKILL to what it has left in its
/// process group and in its session.
void end_session(const ChildProcess& leader) noexcept;

/// A process that is gone already is no error. Also of one that runs as a user of instances.
[[nodiscard]] Result<void> signal_process(const ChildProcess& process, int signal);

/// The same of a process that has become another user's. For that root needs no CAP_KILL, only CAP_SETUID.
[[nodiscard]] Result<void> signal_process_of(uid_t user, const ChildProcess& process, int signal);

/// SIGKILL, waits for the end, and reaps it: of a child that cannot be supervised.
void kill_and_reap(const ChildProcess& process) noexcept;

struct ReportChannel {
  PacketSocket ours;
  UniqueFd childs;
};
[[nodiscard]] Result<ReportChannel> make_report_channel();

struct OutputPipe {
  UniqueFd read_end;  ///< non-blocking
  UniqueFd write_end;
};
[[nodiscard]] Result<OutputPipe> make_output_pipe();
/// The data that can be read now, up to `most` bytes.
[[nodiscard]] std::string read_available(int fd, std::size_t most);

/// Nothing: there is no such process.
[[nodiscard]] std::optional<uid_t> user_of_process(pid_t pid);

/// The union of the cores that the threads of a process may run on, ascending.
[[nodiscard]] std::vector<int> cores_of_process(pid_t pid);

/// The folder that this program lies in.
[[nodiscard]] std::string program_directory();

}  // namespace plchost
