#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "schedulers/tasks/task_config.hpp"
#include "schedulers/tasks/task_kind.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

Result<void> check_kind(const TaskConfig& task) {
  if (const TaskKindEntry* const kind = find_task_kind(task.kind)) return kind->check(task);
  std::vector<std::string> known;
  for (const TaskKindTraits& kind : kTaskKinds)
    known.push_back(fmt::format("{} {}", std::to_underlying(kind.kind), kind.name));
  return bad_task(task, fmt::format("kind {} does not exist; known are {}", std::to_underlying(task.kind),
                                    fmt::join(known, ", ")));
}

// Only what is planned can be moved against others, or late.
Result<void> check_plan(const TaskConfig& task) {
  const TaskKindEntry* const kind = find_task_kind(task.kind);
  if (kind == nullptr || kind->has_grid) return {};
  if (task.start_offset != Duration::zero())
    return bad_task(task, "only a cyclic task can have a start offset");
  if (task.late != LatePolicy::next) return bad_task(task, "only a cyclic task can have a late policy");
  return {};
}

Result<void> check_watchdog(const TaskConfig& task) {
  const TaskWatchdog& watchdog = task.watchdog;
  if (watchdog.time < Duration::zero() || watchdog.time > kMaxWatchdogTime) {
    return bad_task(task,
                    fmt::format("its watchdog time must be 0 (off) to {} us",
                                std::chrono::floor<std::chrono::microseconds>(kMaxWatchdogTime).count()));
  }
  if (watchdog.sensitivity < kWatchdogSensitivity.lowest ||
      watchdog.sensitivity > kWatchdogSensitivity.highest) {
    return bad_task(task, fmt::format("its watchdog sensitivity must be {} to {}",
                                      kWatchdogSensitivity.lowest, kWatchdogSensitivity.highest));
  }
  if (watchdog.omitted_cycles > kMaxWatchdogCount) {
    return bad_task(task, fmt::format("its omitted cycles must be 0 (off) to {}", kMaxWatchdogCount));
  }
  return {};
}

}  // namespace

std::unexpected<Error> bad_task(const TaskConfig& task, std::string_view text) {
  return failure(ErrorCode::invalid_argument, fmt::format("task '{}': {}", task.name, text));
}

Result<void> check_task(const TaskConfig& task) {
  if (auto name = check_name("task", task.name, kMaxTaskName); !name) return name;
  if (task.iec_priority < 0 || task.iec_priority > kLowestIecPriority) {
    return bad_task(
        task, fmt::format("priority {} must be 0 (highest) to {}", task.iec_priority, kLowestIecPriority));
  }
  if (!task.entry) return bad_task(task, "it has no code to run");
  if (auto valid = check_plan(task); !valid) return valid;
  if (auto valid = check_watchdog(task); !valid) return valid;
  return check_kind(task);
}

Result<void> check_tasks(const std::vector<TaskConfig>& tasks) {
  std::set<std::string_view> names;
  for (const TaskConfig& task : tasks) {
    if (auto valid = check_task(task); !valid) return valid;
    if (!names.insert(task.name).second) return bad_task(task, "there is another task of this name");
  }
  return {};
}

}  // namespace plchost
