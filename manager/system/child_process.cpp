#include "manager/system/child_process.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/threads/process_start.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

namespace {

struct SpawnActions {
  posix_spawn_file_actions_t files{};
  posix_spawnattr_t attributes{};
  SpawnActions() noexcept {
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&attributes);
  }
  ~SpawnActions() {
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
  }
  SpawnActions(const SpawnActions&) = delete;
  SpawnActions& operator=(const SpawnActions&) = delete;
};

Result<void> prepare(SpawnActions& actions, const SpawnRequest& request) {
  int error = posix_spawn_file_actions_addopen(&actions.files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  if (error == 0 && request.output_fd >= 0) {
    error = posix_spawn_file_actions_adddup2(&actions.files, request.output_fd, STDOUT_FILENO);
    if (error == 0) {
      error = posix_spawn_file_actions_adddup2(&actions.files, request.output_fd, STDERR_FILENO);
    }
  }
  int first_to_close = STDERR_FILENO + 1;
  if (error == 0 && request.report_fd >= 0) {
    error = posix_spawn_file_actions_adddup2(&actions.files, request.report_fd, kChildReportFd);
    first_to_close = kChildReportFd + 1;
  }
  // Ours are all CLOEXEC; descriptors that the manager itself inherited may not be.
  if (error == 0) error = posix_spawn_file_actions_addclosefrom_np(&actions.files, first_to_close);
  sigset_t none;
  sigset_t all;
  sigemptyset(&none);
  sigfillset(&all);
  sigdelset(&all, SIGPIPE);  // stays ignored: a PLC does not end because nobody reads its log any more
  if (error == 0) error = posix_spawnattr_setsigmask(&actions.attributes, &none);
  if (error == 0) error = posix_spawnattr_setsigdefault(&actions.attributes, &all);
  // A session of its own: neither Ctrl-C nor the end of the manager's terminal reaches a PLC.
  constexpr int kFlags = POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSID;
  if (error == 0) error = posix_spawnattr_setflags(&actions.attributes, static_cast<short>(kFlags));
  return check_returned(error, "cannot prepare to start " + request.arguments.front());
}

constexpr auto kSameUser = static_cast<uid_t>(-1);

/// As long as this exists, the thread may signal the processes of that user. For that root needs no CAP_KILL,
/// only CAP_SETUID. The system calls and not the functions: those would change all threads.
class SignalsAsUser {
 public:
  explicit SignalsAsUser(uid_t user) noexcept
      : own_(::geteuid()), dumpable_(::prctl(PR_GET_DUMPABLE, 0, 0, 0, 0)) {
    can_ = ::syscall(SYS_setresuid, kSameUser, user, kSameUser) == 0;
  }
  ~SignalsAsUser() { (void)back(); }
  SignalsAsUser(const SignalsAsUser&) = delete;
  SignalsAsUser& operator=(const SignalsAsUser&) = delete;
  [[nodiscard]] bool can() const noexcept { return can_; }
  [[nodiscard]] Result<void> back() noexcept {
    if (!can_) return {};
    can_ = false;
    PLCHOST_TRY(
        check_errno(::syscall(SYS_setresuid, kSameUser, own_, kSameUser), "cannot be the own user again"));
    if (dumpable_ == 1) (void)::prctl(PR_SET_DUMPABLE, 1, 0, 0, 0);  // each change of the user clears it
    return {};
  }

 private:
  uid_t own_;
  int dumpable_;
  bool can_ = false;
};

// Nothing: it is no process of a user that only instances have.
std::optional<uid_t> user_of_instance(pid_t pid) {
  if (::geteuid() != 0) return std::nullopt;
  const auto user = user_of_process(pid);
  return user && *user != 0 && is_trusted_owner(*user) ? user : std::nullopt;
}

Result<void> send_signal(const ChildProcess& process, int signal) {
  const long sent = ::syscall(SYS_pidfd_send_signal, process.pidfd.get(), signal, nullptr, 0);
  if (sent != 0 && errno == ESRCH) return {};
  PLCHOST_TRY(check_errno(sent, fmt::format("cannot signal {} to process {}", signal, process.pid)));
  return {};
}

void kill_group(pid_t leader) noexcept {
  const auto user = user_of_instance(leader);
  if (!user) {
    ::kill(-leader, SIGKILL);
    return;
  }
  const SignalsAsUser rights(*user);
  ::kill(-leader, SIGKILL);
}

// The number of the session stays that of its leader while anybody is in it.
void kill_session(pid_t leader) noexcept {
  std::error_code error;
  for (std::filesystem::directory_iterator at("/proc", error), end; !error && at != end;
       at.increment(error)) {
    const auto pid = static_cast<pid_t>(std::strtol(at->path().filename().c_str(), nullptr, 10));
    if (pid <= 0 || pid == leader || ::getsid(pid) != leader) continue;
    const auto member = open_process(pid);
    // Looked at again: only now the number cannot come to mean another process.
    if (member && ::getsid(pid) == leader) (void)signal_process(*member, SIGKILL);
  }
}

}  // namespace

std::string ExitStatus::describe() const {
  if (out_of_memory) return "ended by the kernel, out of memory: memory_max_mib, or the host has no more";
  if (!known) return "ended (status unknown: it was adopted)";
  if (kind == Kind::exited) return fmt::format("exit code {}", value);
  const char* name = sigabbrev_np(value);
  return name != nullptr ? fmt::format("killed by SIG{}", name) : fmt::format("killed by signal {}", value);
}

Result<ChildProcess> spawn_process(const SpawnRequest& request) {
  SpawnActions actions;
  PLCHOST_TRY(prepare(actions, request));
  std::vector<std::string> arguments = request.arguments;
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  pid_t pid = 0;
  const int error =
      ::posix_spawn(&pid, pointers.front(), &actions.files, &actions.attributes, pointers.data(), environ);
  PLCHOST_TRY(check_returned(error, "cannot start " + request.arguments.front()));
  auto opened = open_process(pid);
  if (!opened) {
    // Without a pidfd it could not be supervised. It was not waited for yet, so the number is still its own.
    ::kill(pid, SIGKILL);
    ::waitpid(pid, nullptr, 0);
  }
  return opened;
}

Result<ChildProcess> open_process(pid_t pid) {
  const auto fd = static_cast<int>(::syscall(SYS_pidfd_open, pid, 0));  // CLOEXEC always
  PLCHOST_TRY(check_errno(fd, fmt::format("cannot open process {}", pid)));
  return ChildProcess{.pid = pid, .pidfd = UniqueFd(fd)};
}

ExitStatus reap_process(const ChildProcess& process) {
  siginfo_t info{};
  int waited = 0;
  do {
    waited = ::waitid(P_PIDFD, static_cast<id_t>(process.pidfd.get()), &info, WEXITED | WNOHANG);
  } while (waited != 0 && errno == EINTR);
  if (waited != 0 || info.si_pid == 0) return ExitStatus{.known = false};
  const bool exited = info.si_code == CLD_EXITED;
  return ExitStatus{.kind = exited ? ExitStatus::Kind::exited : ExitStatus::Kind::killed,
                    .value = info.si_status};
}

void end_session(const ChildProcess& leader) noexcept {
  siginfo_t info{};
  // Of a child that is not reaped yet the number is still its own, as that of its group and its session, too.
  const int waited =
      ::waitid(P_PIDFD, static_cast<id_t>(leader.pidfd.get()), &info, WEXITED | WNOHANG | WNOWAIT);
  if (waited == 0 && info.si_pid == leader.pid) {
    kill_group(leader.pid);
    return kill_session(leader.pid);
  }
  // Another's child: if a younger process has the number by now, it may lead a session of its own.
  if (!start_of(leader.pid)) kill_session(leader.pid);
}

void kill_and_reap(const ChildProcess& process) noexcept {
  (void)signal_process(process, SIGKILL);
  siginfo_t info{};
  while (::waitid(P_PIDFD, static_cast<id_t>(process.pidfd.get()), &info, WEXITED) != 0 && errno == EINTR) {
  }
}

Result<void> signal_process(const ChildProcess& process, int signal) {
  auto sent = send_signal(process, signal);
  if (sent || sent.error().system_errno != EPERM) return sent;
  const auto user = user_of_instance(process.pid);
  return user ? signal_process_of(*user, process, signal) : sent;
}

Result<void> signal_process_of(uid_t user, const ChildProcess& process, int signal) {
  auto sent = send_signal(process, signal);
  if (sent || sent.error().system_errno != EPERM) return sent;
  SignalsAsUser rights(user);
  if (!rights.can()) return sent;
  sent = send_signal(process, signal);
  PLCHOST_TRY(rights.back());
  return sent;
}

Result<ReportChannel> make_report_channel() {
  std::array<int, 2> fds{};
  PLCHOST_TRY(check_errno(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, fds.data()),
                          "cannot create a pair of sockets"));
  ReportChannel channel{.ours = PacketSocket(UniqueFd(fds[0])), .childs = UniqueFd(fds[1])};
  PLCHOST_TRY(check_errno(::fcntl(fds[0], F_SETFL, O_NONBLOCK), "cannot set the flags of a descriptor"));
  return channel;
}

Result<OutputPipe> make_output_pipe() {
  std::array<int, 2> fds{};
  PLCHOST_TRY(check_errno(::pipe2(fds.data(), O_CLOEXEC), "cannot create a pipe"));
  OutputPipe pipe{.read_end = UniqueFd(fds[0]), .write_end = UniqueFd(fds[1])};
  PLCHOST_TRY(check_errno(::fcntl(fds[0], F_SETFL, O_NONBLOCK), "cannot set the flags of a descriptor"));
  return pipe;
}

std::string read_available(int fd, std::size_t most) {
  std::string text(most, '\0');
  std::size_t length = 0;
  while (length < most) {
    const ssize_t got = ::read(fd, text.data() + length, most - length);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    length += static_cast<std::size_t>(got);
  }
  text.resize(length);
  return text;
}

std::optional<uid_t> user_of_process(pid_t pid) {
  std::ifstream status(fmt::format("/proc/{}/status", pid));
  constexpr std::string_view kField = "Uid:";
  for (std::string line; std::getline(status, line);) {
    if (!line.starts_with(kField)) continue;
    const std::size_t begin = line.find_first_not_of("\t ", kField.size());
    uid_t user = 0;
    if (begin == std::string::npos) return std::nullopt;
    const auto [end, error] = std::from_chars(line.data() + begin, line.data() + line.size(), user);
    return error == std::errc() ? std::optional(user) : std::nullopt;
  }
  return std::nullopt;
}

std::vector<int> cores_of_process(pid_t pid) {
  std::set<int> cores;
  std::error_code error;
  const std::filesystem::path tasks = fmt::format("/proc/{}/task", pid);
  for (std::filesystem::directory_iterator at(tasks, error), end; !error && at != end; at.increment(error)) {
    const auto thread = static_cast<pid_t>(std::strtol(at->path().filename().c_str(), nullptr, 10));
    if (const auto allowed = allowed_cores(thread)) cores.insert(allowed->begin(), allowed->end());
  }
  return {cores.begin(), cores.end()};
}

std::string program_directory() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path().string();
}

}  // namespace plchost
