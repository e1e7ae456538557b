#include "instances/adapters/run_program.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

constexpr std::size_t kMaxOutput = std::size_t{1} << 20;
constexpr int kLookMs = 50;
constexpr int kGraceMs = 1000;

struct FileActions {
  posix_spawn_file_actions_t actions{};
  FileActions() { posix_spawn_file_actions_init(&actions); }
  FileActions(const FileActions&) = delete;
  FileActions& operator=(const FileActions&) = delete;
  ~FileActions() { posix_spawn_file_actions_destroy(&actions); }
};

struct OwnGroup {
  posix_spawnattr_t attributes{};
  OwnGroup() {
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
  }
  OwnGroup(const OwnGroup&) = delete;
  OwnGroup& operator=(const OwnGroup&) = delete;
  ~OwnGroup() { posix_spawnattr_destroy(&attributes); }
};

class Child {
 public:
  Child(pid_t pid, UniqueFd output)
      : pid_(pid), ended_(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0))), output_(std::move(output)) {}

  ProgramEnd run(const RunLimits& limits) {
    const TimePoint begin = MonotonicClock::now();
    while (!has_ended(kLookMs)) {
      end_.cancelled = limits.cancelled && limits.cancelled();
      end_.over_limit = limits.time > Duration{} && MonotonicClock::now() - begin > limits.time;
      if (!end_.cancelled && !end_.over_limit) continue;
      end_group();
      break;
    }
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    read_output();
    if (WIFSIGNALED(status)) end_.signal = WTERMSIG(status);
    if (WIFEXITED(status)) end_.exit_code = WEXITSTATUS(status);
    return std::move(end_);
  }

 private:
  // Also reads what it says, as it waits when the pipe is full. Its own children may keep the pipe open
  // longer than it runs.
  bool has_ended(int wait_ms) {
    std::array<pollfd, 2> wanted{pollfd{ended_.get(), POLLIN, 0}, pollfd{output_.get(), POLLIN, 0}};
    if (::poll(wanted.data(), wanted.size(), wait_ms) <= 0) return false;
    if (wanted[1].revents != 0) read_output();
    return (wanted[0].revents & POLLIN) != 0;
  }
  void read_output() {
    std::array<char, 4096> piece{};
    while (output_) {
      const ssize_t count = ::read(output_.get(), piece.data(), piece.size());
      if (count < 0 && errno == EINTR) continue;
      if (count < 0 && errno == EAGAIN) return;
      if (count <= 0) return output_.reset();
      const std::size_t room = kMaxOutput - end_.output.size();
      end_.output.append(piece.data(), std::min(static_cast<std::size_t>(count), room));
    }
  }
  // Before it is waited for: until then no other group can have its number.
  void end_group() {
    ::kill(-pid_, SIGTERM);
    const TimePoint begin = MonotonicClock::now();
    while (!has_ended(kLookMs) && MonotonicClock::now() - begin < std::chrono::milliseconds(kGraceMs)) {
    }
    ::kill(-pid_, SIGKILL);
  }

  pid_t pid_;
  UniqueFd ended_;
  UniqueFd output_;
  ProgramEnd end_;
};

}  // namespace

Result<ProgramEnd> run_program(const std::vector<std::string>& arguments, const std::string& folder,
                               const RunLimits& limits) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return failure(ErrorCode::system, "cannot make a pipe", errno);
  UniqueFd output(ends[0]);
  UniqueFd childs(ends[1]);
  ::fcntl(output.get(), F_SETFL, O_NONBLOCK);
  FileActions files;
  posix_spawn_file_actions_addopen(&files.actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&files.actions, childs.get(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files.actions, childs.get(), STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(&files.actions, folder.c_str());
  const OwnGroup group;
  std::vector<char*> words;
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  pid_t pid = 0;
  const int error =
      ::posix_spawnp(&pid, words.front(), &files.actions, &group.attributes, words.data(), environ);
  if (error != 0) return failure(ErrorCode::not_found, arguments.front(), error);
  childs.reset();
  return Child(pid, std::move(output)).run(limits);
}

}  // namespace plchost
