#pragma once

#include <cstddef>
#include <span>

#include <sys/types.h>

#include "shm/base/names.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// "thread 'hog' (SCHED_FIFO 80)"; empty: none.
using ThreadText = FixedText<63>;

/// The processor time that this process and its threads have used, and the threads that may take it before
/// them. Tests give figures of their own.
class ProcessorTimes {
 public:
  virtual ~ProcessorTimes() = default;
  /// All of its threads together, since its start. Real-time, a system call.
  [[nodiscard]] virtual Duration of_process() const noexcept = 0;
  /// One thread of this process; 0 if it has ended. Real-time, a system call.
  [[nodiscard]] virtual Duration of_thread(pid_t thread) const noexcept = 0;
  /// So long a thread of this process has been ready while others had the processor, since its start; a wait
  /// that goes on counts when it has ended. 0: it has ended, or the kernel does not count. Three system
  /// calls.
  [[nodiscard]] virtual Duration ready_time_of_thread(pid_t thread) const noexcept = 0;
  /// One thread of this process waits for something else than the processor. Real-time, three system calls.
  [[nodiscard]] virtual bool sleeps(pid_t thread) const noexcept = 0;
  /// The threads of this process with a real-time priority, as many as `found` has room for; how many that
  /// are. Real-time, a system call for each thread of the process.
  [[nodiscard]] virtual std::size_t real_time_threads(std::span<pid_t> found) const noexcept = 0;
  /// Takes its real-time priority from a thread of this process. The text names thread and priority; empty:
  /// it had none, or has ended. Real-time, signal handlers included; six system calls.
  [[nodiscard]] virtual ThreadText demote(pid_t thread) const noexcept = 0;
};

/// As the kernel counts them.
[[nodiscard]] const ProcessorTimes& linux_processor_times() noexcept;

}  // namespace plchost
