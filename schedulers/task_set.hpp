#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "schedulers/scheduler.hpp"
#include "schedulers/task_config.hpp"
#include "shm/base/counted_event.hpp"
#include "shm/base/result.hpp"
#include "shm/base/task_statistics.hpp"

namespace plchost {

/// Where tasks find what lies outside: given by the instance (the pool), or by a test.
struct TaskEnvironment {
  /// The counter behind an external event's name. Called once per external task in create().
  std::function<Result<CountedEvent*>(std::string_view event)> find_event;
  /// Zeroed memory for the statistics of task number `index`. It outlives the TaskSet.
  std::function<TaskStatistics&(std::size_t index)> statistics;
  /// Tells that a task's thread runs cycles (true) or is parked (false). May be empty. Soft thread.
  std::function<void(std::size_t index, bool running)> state_changed;
};

/// The tasks of one application with their threads, under one scheduler that can be exchanged while they run.
/// All functions are set-up, from one control thread.
class TaskSet {
 public:
  /// Validates all tasks (names unique, priorities 0..31, an interval where one is needed ...), makes them,
  /// and starts their threads parked. The error names the task and what is allowed.
  [[nodiscard]] static Result<std::unique_ptr<TaskSet>> create(Clock& clock, PriorityBand band,
                                                               std::vector<TaskConfig> tasks,
                                                               TaskEnvironment environment);
  virtual ~TaskSet() = default;

  /// Releases the tasks under the scheduler of that name. wrong_state: they run already. External events
  /// posted while the tasks were stopped are not run.
  [[nodiscard]] virtual Result<void> start(std::string_view scheduler, const SchedulerSettings& settings) = 0;
  /// Parks all tasks at the end of their cycles. timed_out: names the tasks that did not come back within
  /// `limit`; they are parked when they do.
  [[nodiscard]] virtual Result<void> stop(Duration limit) = 0;
  /// Exchanges the scheduler. Running tasks keep their grid, their backlog of events, counters and variables.
  /// On failure they run on under the old one.
  [[nodiscard]] virtual Result<void> switch_to(std::string_view scheduler,
                                               const SchedulerSettings& settings) = 0;

  [[nodiscard]] virtual bool running() const noexcept = 0;
  /// Of the scheduler in use, or empty before the first start.
  [[nodiscard]] virtual std::string_view scheduler_name() const noexcept = 0;
};

}  // namespace plchost
