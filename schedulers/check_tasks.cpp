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

Result<void> check_task(const TaskConfig& task) {
  if (auto name = check_name("task", task.name, kMaxTaskName); !name) return name;
  if (task.iec_priority < 0 || task.iec_priority > kLowestIecPriority) {
    return bad(task,
               fmt::format("priority {} must be 0 (highest) to {}", task.iec_priority, kLowestIecPriority));
  }
  if (!task.entry) return bad(task, "it has no code to run");
  return check_kind(task);
}

}  // namespace

Result<void> check_tasks(const std::vector<TaskConfig>& tasks) {
  std::set<std::string_view> names;
  for (const TaskConfig& task : tasks) {
    if (auto valid = check_task(task); !valid) return valid;
    if (!names.insert(task.name).second) return bad(task, "there is another task of this name");
  }
  return {};
}

}  // namespace plchost
