#pragma once

#include <sys/types.h>

#include "shm/base/time.hpp"

namespace plchost {

/// The processor time that this process and its threads have used: tests give figures of their own.
class ProcessorTimes {
 public:
  virtual ~ProcessorTimes() = default;
  /// All of its threads together, since its start. Real-time, a system call.
  [[nodiscard]] virtual Duration of_process() const noexcept = 0;
  /// One thread of this process; 0 if it has ended. Real-time, a system call.
  [[nodiscard]] virtual Duration of_thread(pid_t thread) const noexcept = 0;
  /// One thread of this process waits for something else than the processor. Real-time, three system calls.
  [[nodiscard]] virtual bool sleeps(pid_t thread) const noexcept = 0;
};

/// As the kernel counts them.
[[nodiscard]] const ProcessorTimes& linux_processor_times() noexcept;

}  // namespace plchost
