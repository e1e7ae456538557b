#include "tests/bench/child.hpp"

#include <array>
#include <csignal>
#include <cstdlib>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/process/end_with_parent.hpp"

namespace plchost::bench {

Child& Child::operator=(Child&& other) noexcept {
  if (this != &other) {
    end();
    pid_ = std::exchange(other.pid_, 0);
  }
  return *this;
}

Result<Child> Child::start(const std::vector<std::string>& arguments, int output) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  if (output >= 0) ::posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  pid_t pid = 0;
  const int error = ::posix_spawnp(&pid, argv.front(), &actions, nullptr, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  PLCHOST_TRY(check_returned(error, "start " + arguments.front()));
  return Child(pid);
}

void Child::ask_to_end() const noexcept {
  if (pid_ != 0) ::kill(pid_, SIGTERM);
}

void Child::end() noexcept {
  if (pid_ == 0) return;
  ask_to_end();
  ::waitpid(std::exchange(pid_, 0), nullptr, 0);
}

Result<void> Child::wait() {
  int status = 0;
  const pid_t pid = std::exchange(pid_, 0);
  if (::waitpid(pid, &status, 0) != pid) return failure(ErrorCode::system, "waitpid", errno);
  if (status != 0) return failure(ErrorCode::system, fmt::format("it ended with status {:#x}", status));
  return {};
}

Result<std::string> output_of(const std::vector<std::string>& arguments) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return failure(ErrorCode::system, "pipe", errno);
  const UniqueFd from(ends[0]);
  UniqueFd to(ends[1]);
  PLCHOST_TRY_ASSIGN(auto child, Child::start(arguments, to.get()));
  to = UniqueFd();
  std::string text;
  std::array<char, 4096> block{};
  for (ssize_t got = 0; (got = ::read(from.get(), block.data(), block.size())) > 0;)
    text.append(block.data(), static_cast<std::size_t>(got));
  if (auto ended = child.wait(); !ended) return failure_in(arguments.front(), std::move(ended.error()));
  return text;
}

void end_with(pid_t parent, int signal) noexcept {
  if (!end_with_parent(parent, signal)) ::_exit(1);
}

bool is_installed(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::string_view rest = path == nullptr ? "" : path;
  while (!rest.empty()) {
    const auto length = std::min(rest.find(':'), rest.size());
    const std::filesystem::path folder(rest.substr(0, length));
    if (::access((folder / program).c_str(), X_OK) == 0) return true;
    rest.remove_prefix(std::min(length + 1, rest.size()));
  }
  return false;
}

}  // namespace plchost::bench
