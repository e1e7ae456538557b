#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <pthread.h>
#include <signal.h>
#include <sys/types.h>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// How a thread is ordered by the operating system.
struct ThreadPriority {
  int fifo = 0;  ///< 1..99: SCHED_FIFO at this priority; 0: SCHED_OTHER
  int nice = 0;  ///< only for SCHED_OTHER
};

/// A thread with explicit scheduling (never inherited, and never handed on to threads and processes that it
/// makes), a name and a pre-faulted stack. Joins in its
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
  /// Joins, unless `abandoned()` becomes true first: then the thread is left alone until the process ends.
  /// For a thread that may be parked for good where it stands. `abandoned` is looked at every 10 ms. Not
  /// beyond `deadline` (real time). false: it has not ended, and can be joined later.
  [[nodiscard]] bool join_until(TimePoint deadline, const std::function<bool()>& abandoned) noexcept;
  [[nodiscard]] bool joinable() const noexcept { return running_; }
  /// It ends when its body returns, or with the process.
  void detach() noexcept {
    if (std::exchange(running_, false)) pthread_detach(handle_);
  }
  /// To a thread that was not joined yet.
  void send(int signal) const noexcept {
    if (running_) pthread_kill(handle_, signal);
  }

 private:
  pthread_t handle_{};
  bool running_ = false;
};

/// A stack on which a thread handles signals, so that the overflow of its own stack can be handled, too.
/// Guard pages around it; part of the locked memory. It outlives the thread that uses it.
class AlternateStack {
 public:
  /// Set-up.
  [[nodiscard]] static Result<AlternateStack> make();
  AlternateStack(AlternateStack&& other) noexcept;
  AlternateStack& operator=(AlternateStack&&) = delete;
  AlternateStack(const AlternateStack&) = delete;
  AlternateStack& operator=(const AlternateStack&) = delete;
  ~AlternateStack();

  /// The calling thread handles signals on `stack` from now on, until this object goes.
  class Use {
   public:
    explicit Use(const AlternateStack& stack) noexcept;
    ~Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    stack_t before_{};
  };

 private:
  AlternateStack(std::byte* memory, std::size_t size) noexcept : memory_(memory), size_(size) {}
  std::byte* memory_;
  std::size_t size_;  // of the whole mapping, guard pages included
};

/// Binds a whole process (0: this one), all of its threads, to the cores, and reads back what was granted.
[[nodiscard]] Result<std::vector<int>> bind_process_to_cores(pid_t pid, const std::vector<int>& cores);

/// The cores that a thread (0: the calling one) may run on.
[[nodiscard]] Result<std::vector<int>> allowed_cores(pid_t thread);

/// The cores that are on line in this host, sorted.
[[nodiscard]] Result<std::vector<int>> online_cores();

}  // namespace plchost
