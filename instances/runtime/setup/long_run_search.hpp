#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>

#include <sys/types.h>

#include "schedulers/faults/processor_guard.hpp"
#include "schedulers/faults/processor_times.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Finds threads of this process with a real-time priority that run without a pause, by the processor time
/// that each uses between two looks. The kernel's own limit (see ProcessorGuard) cannot interrupt a thread
/// that blocks SIGXCPU, and counts nothing on a core without ticks. One thread at a time; set-up.
class LongRunSearch {
 public:
  /// More threads with a real-time priority than that are not looked at.
  static constexpr std::size_t kMost = 256;

  /// `limit`: a thread may run for so long. `concerns`: threads for which it says false may run for ever.
  LongRunSearch(const ProcessorTimes& times, Duration limit, std::function<bool(pid_t)> concerns)
      : times_(times), limit_(limit), concerns_(std::move(concerns)) {}

  /// Takes the real-time priority from a thread that has run for longer than the limit. To be called several
  /// times within that.
  [[nodiscard]] std::optional<ProcessorGuard::Taker> look(TimePoint now);

 private:
  struct Run {
    Duration used{};    // by the thread, since its start
    Duration lasted{};  // without a pause, as far as the looks tell
  };

  const ProcessorTimes& times_;
  Duration limit_;
  std::function<bool(pid_t)> concerns_;
  TimePoint looked_{};
  std::map<pid_t, Run> runs_;
};

}  // namespace plchost
