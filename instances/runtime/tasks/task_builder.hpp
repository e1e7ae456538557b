#pragma once

#include <memory>
#include <span>
#include <vector>

#include "instances/plc_app.h"
#include "instances/runtime/settings/settings.hpp"
#include "schedulers/tasks/task_config.hpp"
#include "shm/base/result.hpp"
#include "shm/pages/instance_page.hpp"

namespace plchost {

/// The function of its application that a task runs. Another version of that may be put in its place while no
/// task is in a cycle and no event variable is read.
struct TaskCode {
  Task_Info* info = nullptr;  ///< where its figures are written
  PLC_TASK_FUNCTION run = nullptr;
  PLC_EVENT_FUNCTION read = nullptr;  ///< event tasks
};
using TaskCodes = std::vector<std::shared_ptr<TaskCode>>;

/// Checks the whole task configuration of an application and translates it for the schedulers. The tasks'
/// functions are called with plc_current_task() set, and their figures are written back. `setup` outlives the
/// tasks, unless `codes`, which gets what each of them runs, is given others. invalid_argument: the text
/// names the task, the field, and what is allowed. Set-up.
[[nodiscard]] Result<std::vector<TaskConfig>> build_tasks(const sys_setup_tasks_struct& setup,
                                                          TaskCodes& codes);
[[nodiscard]] Result<std::vector<TaskConfig>> build_tasks(const sys_setup_tasks_struct& setup);

/// The options of the C interface, checked as far as they can be without the task. invalid_argument: the text
/// names the field and the allowed values. Set-up.
[[nodiscard]] Result<TaskSettings> from_options(const char* task, const Task_Options* options);

/// Writes `settings` into the tasks that they name. invalid_argument: there is no such task (the text lists
/// what there is), or it is not of the kind that can have this. Set-up.
[[nodiscard]] Result<void> apply_task_settings(std::span<const TaskSettings> settings,
                                               std::vector<TaskConfig>& tasks);

/// Writes the cycle times and the jitter, in us, into the application's own memory. Real-time.
void write_back(const TaskCounters& counters, Task_Info& task) noexcept;

/// How the status page describes a task.
[[nodiscard]] TaskIdentity identity_of(const TaskConfig& task);

}  // namespace plchost
