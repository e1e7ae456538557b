#include "tests/integration/api/child.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/own_name.hpp"

extern char** environ;

namespace plchost {

Child::Child(const std::string& program, const std::vector<std::string>& arguments,
             const std::string& output_file) {
  std::vector<std::string> texts{program};
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& text : texts) argv.push_back(text.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (!output_file.empty()) {
    const std::string errors = output_file + ".errors";
    posix_spawn_file_actions_addopen(&actions, 1, output_file.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
    posix_spawn_file_actions_addopen(&actions, 2, errors.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
  }
  if (::posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(), environ) != 0) pid_ = 0;
  posix_spawn_file_actions_destroy(&actions);
}

Child::~Child() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

int Child::wait() {
  int status = 0;
  if (::waitpid(pid_, &status, 0) != pid_) return -1;
  pid_ = 0;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

namespace {

std::string read_and_remove(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  std::filesystem::remove(path);
  return text.str();
}

}  // namespace

RunResult run_program(const std::string& program, const std::vector<std::string>& arguments) {
  const std::string file = own_path("output");
  RunResult result;
  result.code = Child(program, arguments, file).wait();
  result.output = read_and_remove(file);
  result.errors = read_and_remove(file + ".errors");
  return result;
}

RunResult run_plcctl(std::uint32_t domain, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"--domain", std::to_string(domain), "--timeout", "10"});
  return run_program(PLCCTL_PROGRAM, arguments);
}

}  // namespace plchost
