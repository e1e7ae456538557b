#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/base/task_kind.hpp"
#include "shm/base/task_statistics.hpp"
#include "shm/base/thread.hpp"
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
                                  ///< that takes `time`; 1..kMaxWatchdogCount
  std::uint32_t omitted_cycles = 0;  ///< hits when this many releases in a row did not run; 0: off
  WatchdogPolicy policy = WatchdogPolicy::application;
  bool operator==(const TaskWatchdog&) const = default;
};
inline constexpr std::uint32_t kMaxWatchdogCount = 1'000'000;
/// 2^32 us, the range of the C interface.
inline constexpr Duration kMaxWatchdogTime = std::chrono::microseconds(0xffff'ffff);

/// IEC priorities: 0 (highest) to 31; 0..15 are SCHED_FIFO, 16..31 SCHED_OTHER.
inline constexpr int kLowestIecPriority = 31;
inline constexpr int kLowestRealTimeIecPriority = 15;
/// The longest interval of a task: the seed's largest, 2^32 ms, is just below.
inline constexpr Duration kMaxInterval = std::chrono::days(50);
/// The shortest that may be set while the task runs: the shortest that an application can be configured with.
inline constexpr Duration kMinRuntimeInterval = std::chrono::microseconds(1);

/// Which part of SCHED_FIFO's range an instance uses, so that of two instances on one core one goes first.
///            supervision  tick   IEC 0..15   switch
///   high         89        88     87..72       71
///   normal       69        68     67..52       51
///   low          49        48     47..32       31
/// All of them are above the API server's threads (at most 20).
enum class PriorityBand : std::uint8_t { high, normal, low };

[[nodiscard]] ThreadPriority supervision_priority(PriorityBand band) noexcept;
[[nodiscard]] ThreadPriority tick_priority(PriorityBand band) noexcept;
/// `iec_priority` 0 to 31. 16..31 become SCHED_OTHER with nice 0..15.
[[nodiscard]] ThreadPriority task_priority(PriorityBand band, int iec_priority) noexcept;
/// Of the control thread while it exchanges the scheduler: it delays no task, and nobody else delays it.
[[nodiscard]] ThreadPriority switch_priority(PriorityBand band) noexcept;

/// One task as the application describes it. Validated by TaskSet::create as a whole.
struct TaskConfig {
  std::string name;
  TaskKind kind{};  ///< at first cyclic
  int iec_priority = 0;
  Duration interval{};  ///< cyclic only: > 0
  /// Cyclic only: its grid is origin + start_offset + n * interval; 0 <= . < interval.
  Duration start_offset{};
  LatePolicy late = LatePolicy::next;  ///< cyclic only
  TaskWatchdog watchdog;
  bool drives_outputs = false;           ///< stops in the first of the two phases of a stop
  std::string external_event;            ///< external only: the event's name
  std::function<bool()> event_variable;  ///< event only: reads the BOOL; called by the tick's thread
  std::function<void()> entry;           ///< one cycle; real-time
  // The runtime's own work around it, on the task's thread; real-time, must not throw. Each may be empty. No
  // watchdog counts or stops it.
  std::function<void()> before_entry;  ///< belongs to the cycle: takes inputs in
  std::function<void()> after_entry;   ///< the same, if `entry` came to its end: puts outputs out
  /// Work that waited for the end of a cycle, after that was recorded. false: there was none.
  std::function<bool()> between_cycles;
  /// Called on the task's thread after each cycle with the new counters; real-time. May be empty.
  std::function<void(const TaskCounters&)> after_cycle;
};

/// As in TaskSet::create, one task by itself, and all. invalid_argument: the text names the task that is not
/// valid, and what is allowed.
[[nodiscard]] Result<void> check_task(const TaskConfig& task);
[[nodiscard]] Result<void> check_tasks(const std::vector<TaskConfig>& tasks);
/// invalid_argument: "task 'NAME': TEXT"
[[nodiscard]] std::unexpected<Error> bad_task(const TaskConfig& task, std::string_view text);

/// How long tasks may take to come to the end of their cycles, in each of the two phases of a stop.
struct StopLimits {
  Duration outputs = std::chrono::seconds(10);  ///< tasks that drive outputs; the others run on meanwhile
  Duration others = std::chrono::seconds(25);
  bool operator==(const StopLimits&) const = default;
};

}  // namespace plchost
