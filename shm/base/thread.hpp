#pragma once

#include <functional>
#include <string>
#include <vector>

#include <pthread.h>
#include <sys/types.h>

#include "shm/base/result.hpp"

namespace plchost {

/// How a thread is ordered by the operating system.
struct ThreadPriority {
  int fifo = 0;  ///< 1..99: SCHED_FIFO at this priority; 0: SCHED_OTHER
  int nice = 0;  ///< only for SCHED_OTHER
};

/// A thread with explicit scheduling (never inherited), a name and a pre-faulted stack. Joins in its
/// destructor; the owner makes the body return first.
class Thread {
 public:
  Thread() noexcept = default;
  Thread(Thread&& other) noexcept;
  Thread& operator=(Thread&& other) noexcept;
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;
  ~Thread() { join(); }

  /// Set-up. The error says why SCHED_FIFO was not granted, if that is the reason. `name` is cut to 15
  /// characters by the kernel. The body must not throw.
  [[nodiscard]] static Result<Thread> start(const std::string& name, ThreadPriority priority,
                                            std::function<void()> body);
  void join() noexcept;
  [[nodiscard]] bool joinable() const noexcept { return running_; }

 private:
  pthread_t handle_{};
  bool running_ = false;
};

/// Binds a whole process (0: this one), all of its threads, to the cores, and reads back what was granted.
[[nodiscard]] Result<std::vector<int>> bind_process_to_cores(pid_t pid, const std::vector<int>& cores);

/// The cores that a thread (0: the calling one) may run on.
[[nodiscard]] Result<std::vector<int>> allowed_cores(pid_t thread);

/// The cores that are on line in this host, from 0.
[[nodiscard]] Result<std::vector<int>> online_cores();

}  // namespace plchost
