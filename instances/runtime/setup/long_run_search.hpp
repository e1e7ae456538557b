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
/// that each has used from look to look. The limit of the kernel (see ProcessorGuard) cannot interrupt one
/// that blocks SIGXCPU, and counts nothing on a core without ticks. The 50 ms that the kernel takes in each
/// second from all real-time threads of a core are no pause. One thread at a time; set-up.
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
  /// The longest run up to the last look in which the thread has done next to nothing else.
  struct Run {
    TimePoint began;
    Duration used_before{};  // by the thread, when that began
  };

  const ProcessorTimes& times_;
  Duration limit_;
  std::function<bool(pid_t)> concerns_;
  std::map<pid_t, Run> runs_;
};

}  // namespace plchost
