#include "instances/adapters/run_program.hpp"

#include <algorithm>
#include <array>
#include <cerrno>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

constexpr std::size_t kMaxOutput = std::size_t{1} << 20;

struct FileActions {
  posix_spawn_file_actions_t actions{};
  FileActions() { posix_spawn_file_actions_init(&actions); }
  FileActions(const FileActions&) = delete;
  FileActions& operator=(const FileActions&) = delete;
  ~FileActions() { posix_spawn_file_actions_destroy(&actions); }
};

std::string read_all(int fd) {
  std::string output;
  std::array<char, 4096> piece{};
  for (;;) {
    const ssize_t count = ::read(fd, piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return output;
    const std::size_t room = kMaxOutput - output.size();
    output.append(piece.data(), std::min(static_cast<std::size_t>(count), room));
  }
}

}  // namespace

Result<ProgramEnd> run_program(const std::vector<std::string>& arguments, const std::string& folder) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return failure(ErrorCode::system, "make a pipe", errno);
  const UniqueFd output(ends[0]);
  UniqueFd childs(ends[1]);
  FileActions files;
  posix_spawn_file_actions_addopen(&files.actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&files.actions, childs.get(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files.actions, childs.get(), STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(&files.actions, folder.c_str());
  std::vector<char*> words;
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  pid_t pid = 0;
  const int error = ::posix_spawnp(&pid, words.front(), &files.actions, nullptr, words.data(), environ);
  if (error != 0) return failure(ErrorCode::not_found, "start " + arguments.front(), error);
  childs = UniqueFd();
  ProgramEnd end{.output = read_all(output.get())};
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status)) end.signal = WTERMSIG(status);
  if (WIFEXITED(status)) end.exit_code = WEXITSTATUS(status);
  return end;
}

}  // namespace plchost
