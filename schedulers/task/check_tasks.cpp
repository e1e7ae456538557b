#include <set>
#include <string_view>

#include <fmt/format.h>

#include "schedulers/task_set.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

std::unexpected<Error> bad(const TaskConfig& task, std::string_view what) {
  return failure(ErrorCode::invalid_argument, fmt::format("task '{}': {}", task.name, what));
}

Result<void> check_kind(const TaskConfig& task) {
  switch (task.kind) {
    case TaskKind::cyclic:
      if (task.interval <= Duration::zero() || task.interval > kMaxInterval) {
        return bad(task,
                   fmt::format("a cyclic task needs an interval above 0 and at most 50 days; it has {} ns",
                               task.interval.count()));
      }
      if (task.start_offset < Duration::zero() || task.start_offset >= task.interval) {
        return bad(task,
                   fmt::format("its start offset of {} ns must be at least 0 and below its interval of {} ns",
                               task.start_offset.count(), task.interval.count()));
      }
      return {};
    case TaskKind::event:
      if (!task.event_variable) return bad(task, "an event task needs a BOOL variable");
      return {};
    case TaskKind::external:
      if (auto name = check_name("external event", task.external_event, kMaxEventName); !name) {
        return bad(task, name.error().message);
      }
      return {};
    case TaskKind::freewheeling:
      return {};
  }
  return bad(task,
             fmt::format("kind {} does not exist; known are 0 cyclic, 1 event, 2 external, 3 freewheeling",
                         static_cast<int>(task.kind)));
}

// The options that only a cyclic task can have.
Result<void> check_not_cyclic(const TaskConfig& task) {
  if (task.kind == TaskKind::cyclic) return {};
  if (task.start_offset != Duration::zero()) return bad(task, "only a cyclic task can have a start offset");
  if (task.late != LatePolicy::next) return bad(task, "only a cyclic task can have a late policy");
  return {};
}

Result<void> check_watchdog(const TaskConfig& task) {
  const TaskWatchdog& watchdog = task.watchdog;
  if (watchdog.time < Duration::zero() || watchdog.time > kMaxWatchdogTime) {
    return bad(task, "its watchdog time must be 0 (off) to 4294967295 us");
  }
  if (watchdog.sensitivity < 1 || watchdog.sensitivity > kMaxWatchdogCount) {
    return bad(task, fmt::format("its watchdog sensitivity must be 1 to {}", kMaxWatchdogCount));
  }
  if (watchdog.omitted_cycles > kMaxWatchdogCount) {
    return bad(task, fmt::format("its omitted cycles must be 0 (off) to {}", kMaxWatchdogCount));
  }
  return {};
}

}  // namespace

Result<void> check_task(const TaskConfig& task) {
  if (auto name = check_name("task", task.name, kMaxTaskName); !name) return name;
  if (task.iec_priority < 0 || task.iec_priority > kLowestIecPriority) {
    return bad(task,
               fmt::format("priority {} must be 0 (highest) to {}", task.iec_priority, kLowestIecPriority));
  }
  if (!task.entry) return bad(task, "it has no code to run");
  if (auto valid = check_not_cyclic(task); !valid) return valid;
  if (auto valid = check_watchdog(task); !valid) return valid;
  return check_kind(task);
}

Result<void> check_tasks(const std::vector<TaskConfig>& tasks) {
  std::set<std::string_view> names;
  for (const TaskConfig& task : tasks) {
    if (auto valid = check_task(task); !valid) return valid;
    if (!names.insert(task.name).second) return bad(task, "there is another task of this name");
  }
  return {};
}

}  // namespace plchost
