#pragma once

#include <csignal>
#include <vector>

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

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
    const pid_t pid = ::fork();
    if (pid == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      run();
      ::_exit(0);
    }
    if (pid > 0) pids_.push_back(pid);
  }

 private:
  std::vector<pid_t> pids_;
};

}  // namespace plchost::bench
