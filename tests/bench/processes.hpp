#pragma once

#include <csignal>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>

#include "tests/bench/child.hpp"

namespace plchost::bench {

/// Processes of this program, which end when this goes.
class Processes {
 public:
  Processes() = default;
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;
  ~Processes() {
    for (const pid_t pid : pids_) {
      ::kill(pid, SIGKILL);
      ::waitpid(pid, nullptr, 0);
    }
  }
  template <class Run>
  void fork(Run run) {
    const pid_t parent = ::getpid();
    const pid_t pid = ::fork();
    if (pid == 0) {
      end_with(parent, SIGKILL);
      run();
      ::_exit(0);
    }
    if (pid > 0) pids_.push_back(pid);
  }

 private:
  std::vector<pid_t> pids_;
};

}  // namespace plchost::bench
