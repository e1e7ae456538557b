#pragma once

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/process/end_with_parent.hpp"

namespace plchost {

/// A program that has nothing to do with plchost and takes a core from all threads without real-time
/// priority, as long as this lives. The kernel leaves those a twentieth of a second in each second; processes
/// of the highest weight take that.
class Stranger {
 public:
  Stranger(int core, int fifo) {
    constexpr int kGreedy = 4;
    const pid_t parent = ::getpid();
    for (int i = 0; i <= kGreedy; ++i) {
      const pid_t pid = ::fork();
      if (pid == 0) take(core, i == 0 ? fifo : 0, parent);
      if (pid > 0) processes_.push_back(pid);
    }
  }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;
  ~Stranger() {
    for (const pid_t pid : processes_) ::kill(pid, SIGKILL);
    for (const pid_t pid : processes_) ::waitpid(pid, nullptr, 0);
  }
  /// The one with the real-time priority.
  [[nodiscard]] pid_t pid() const { return processes_.front(); }

  /// The thread takes only what nobody else wants; or as all others do.
  static void make_modest(pid_t thread, bool modest) {
    const sched_param none{};
    (void)::sched_setscheduler(thread, modest ? SCHED_IDLE : SCHED_OTHER, &none);
    weigh(thread, modest ? 19 : 0);
  }

 private:
  // The kernel shares the core by sessions first, where it groups processes by them.
  static void weigh(pid_t process, int nice) {
    std::ofstream(fmt::format("/proc/{}/autogroup", process)) << nice << std::flush;
  }

  [[noreturn]] static void take(int core, int fifo, pid_t parent) {
    if (!end_with_parent(parent, SIGKILL)) ::_exit(EXIT_FAILURE);
    ::prctl(PR_SET_NAME, "stranger");
    ::setsid();
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(static_cast<std::size_t>(core), &one);
    const sched_param priority{.sched_priority = fifo};
    bool done = ::sched_setaffinity(0, sizeof one, &one) == 0;
    if (fifo > 0) {
      done = done && ::sched_setscheduler(0, SCHED_FIFO, &priority) == 0;
    } else {
      constexpr int kGreediest = -20;
      done = done && ::setpriority(PRIO_PROCESS, 0, kGreediest) == 0;
      weigh(::getpid(), kGreediest);
    }
    constexpr unsigned kSeconds = 120;  // even if the test fails
    ::alarm(kSeconds);
    while (done) continue;
    ::_exit(EXIT_FAILURE);
  }

  std::vector<pid_t> processes_;
};

}  // namespace plchost
