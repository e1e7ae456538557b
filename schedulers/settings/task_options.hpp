#pragma once

#include <cstdint>

#include "shm/base/bounds.hpp"
#include "shm/base/stop_limits.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The action of a cyclic task that is late: wait for the next point of its grid, or run at once.
enum class LatePolicy : std::uint8_t { next, asap };

/// The part that goes to exception when a task's watchdog hits.
enum class WatchdogPolicy : std::uint8_t { application, task };

/// The watchdogs of one task.
struct TaskWatchdog {
  Duration time{};                ///< of one cycle; 0: no time watchdog of its own
  std::uint32_t sensitivity = 1;  ///< hits in a cycle that takes time * sensitivity, or in the n-th in a row
                                  ///< that takes `time`; kWatchdogSensitivity
  std::uint32_t omitted_cycles = 0;  ///< hits when this many releases in a row did not run; 0: off
  WatchdogPolicy policy = WatchdogPolicy::application;
  bool operator==(const TaskWatchdog&) const = default;
};
inline constexpr std::uint32_t kMaxWatchdogCount = 1'000'000;
inline constexpr Bounds<std::uint32_t> kWatchdogSensitivity{.lowest = 1, .highest = kMaxWatchdogCount};
/// 2^32 us, the range of the C interface.
inline constexpr Duration kMaxWatchdogTime = std::chrono::microseconds(0xffff'ffff);

/// The options of a task, with their defaults.
struct TaskOptions {
  /// Cyclic only: its grid is origin + start_offset + n * interval; 0 <= . < interval.
  Duration start_offset{};
  LatePolicy late = LatePolicy::next;  ///< cyclic only
  TaskWatchdog watchdog;
  bool drives_outputs = false;  ///< stops in the first of the two phases of a stop
};

/// IEC priorities: 0 (highest) to 31; 0..15 are SCHED_FIFO, 16..31 SCHED_OTHER.
inline constexpr int kLowestIecPriority = 31;
inline constexpr int kLowestRealTimeIecPriority = 15;
/// The longest interval of a task: the seed's largest, 2^32 ms, is just below.
inline constexpr Duration kMaxInterval = std::chrono::days(50);
/// The shortest that may be set while the task runs: the shortest that an application can be configured with.
inline constexpr Duration kMinRuntimeInterval = std::chrono::microseconds(1);

/// How long tasks may take to come to the end of their cycles, in each of the two phases of a stop.
struct StopLimits {
  Duration outputs = kMaxStopOfOutputs;  ///< tasks that drive outputs; the others run on meanwhile
  Duration others = kMaxStopOfOthers;
  bool operator==(const StopLimits&) const = default;
};

}  // namespace plchost
