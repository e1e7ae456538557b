#pragma once

#include <algorithm>

#include <sys/types.h>

#include "shm/base/time.hpp"

namespace plchost {

/// All threads of a process together, exact to the nanosecond; 0: it has ended.
[[nodiscard]] Duration processor_time_of(pid_t process) noexcept;

/// The processor time of a process, of all its threads, and of the processes that it has started.
struct ProcessorShare {
  Duration ran{};
  Duration waited{};  ///< ready to run, while others had the processor; known once a thread runs again
};

/// Of a process and its descendants, since they began. Zero: it has ended, or the kernel does not tell
/// (/proc/PID/task/TID/schedstat). Reads a file for each thread. Any thread.
[[nodiscard]] ProcessorShare processor_share_of(pid_t process);

/// A time limit for the work of a process. Time in which other programs kept the process from its processor
/// does not count: a machine that is busy makes no good program a failed one. A process that sleeps for too
/// long exceeds the limit as on an idle machine. So does one that computes for ever: it is not waited for
/// once it has had a fifth of the limit as processor time. Such time lengthens the limit to five times at
/// most. Pure.
class WorkLimit {
 public:
  WorkLimit() = default;
  /// `before`: the share when the work began; zero for a process that begins with it.
  WorkLimit(Duration limit, TimePoint began, const ProcessorShare& before = {}) noexcept
      : limit_(limit), began_(began), before_(before) {}

  /// The rest of the limit, at least kLook; zero: it is exceeded. Look again after so long. `known`: for how
  /// long the process got nothing at all, which `share` may not tell yet, and which counts in any case.
  [[nodiscard]] Duration left(TimePoint now, const ProcessorShare& share,
                              Duration known = {}) const noexcept {
    const Duration elapsed = now - began_;
    const Duration ran = std::max(share.ran - before_.ran, Duration::zero());
    // The time in which the process itself had the processor is its own, whichever of its threads waited.
    const Duration of_others = std::max(elapsed - ran, Duration::zero());
    const Duration waited = ran < limit_ / kPartThatComputes
                                ? std::min(share.waited - before_.waited, kMostWaited * limit_)
                                : Duration::zero();
    const Duration kept = std::clamp(std::max(waited, known), Duration::zero(), of_others);
    const Duration rest = limit_ - (elapsed - kept);
    return rest > Duration::zero() ? std::max(rest, kLook) : Duration::zero();
  }

  static constexpr Duration kLook = std::chrono::milliseconds(100);

 private:
  static constexpr int kPartThatComputes = 5;
  static constexpr int kMostWaited = 4;  // limits: one thread that waits must not excuse another for ever
  Duration limit_{};
  TimePoint began_{};
  ProcessorShare before_{};
};

}  // namespace plchost
