#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "schedulers/settings/task_options.hpp"
#include "shm/base/result.hpp"
#include "shm/base/task_kind.hpp"
#include "shm/base/task_statistics.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// One task as the application describes it. Validated by TaskSet::create as a whole.
struct TaskConfig : TaskOptions {
  std::string name;
  TaskKind kind{};  ///< at first cyclic
  int iec_priority = 0;
  Duration interval{};                   ///< cyclic only: > 0
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

}  // namespace plchost
