#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/base/result.hpp"
#include "shm/base/system_call.hpp"

namespace plchost::bench {

/// iceoryx's daemon. It is killed at the end: asked to end, it would first end its clients, which this is one
/// of. So its files, and those of its clients, whose names begin with `clients`, are removed here.
class RouDi {
 public:
  explicit RouDi(std::string clients) : clients_(std::move(clients)) {}
  RouDi(const RouDi&) = delete;
  RouDi& operator=(const RouDi&) = delete;
  ~RouDi() {
    if (pid_ == 0) return;
    ::kill(pid_, SIGKILL);
    int status = 0;
    ::waitpid(pid_, &status, 0);
    for (const char* left : {"/iceoryx_mgmt", "/root"}) ::shm_unlink(left);
    for (const std::string& left : {std::string("roudi"), clients_ + "-bench", clients_ + "-peer"}) {
      ::unlink(("/tmp/" + left).c_str());
      ::unlink(("/tmp/" + left + ".lock").c_str());
    }
    ::unlink("/tmp/iox-unique-roudi.lock");
  }
  [[nodiscard]] Result<void> start() {
    // Without monitoring: a process that measures keeps its other threads waiting.
    std::array<std::string, 5> words{"iox-roudi", "-m", "off", "-l", "off"};
    std::array<char*, 6> arguments{};
    std::ranges::transform(words, arguments.begin(), [](std::string& word) { return word.data(); });
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    const int error = ::posix_spawnp(&pid_, words[0].c_str(), &files, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    return check_returned(error, "start iox-roudi");
  }

 private:
  std::string clients_;
  pid_t pid_ = 0;
};

}  // namespace plchost::bench
