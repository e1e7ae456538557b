#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "instances/plc_app.h"
#include "schedulers/tasks/task_config.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The options of one task, by a [Task.NAME] section of the settings or by a call of plc_set_task_options().
/// Those that it does not name stay as they are.
struct TaskSettings {
  std::string task;
  std::string where;  ///< how errors call it: "line1.cfg:12: [Task.Fast]"
  std::optional<LatePolicy> late{};
  std::optional<Duration> start_offset{};
  std::optional<bool> drives_outputs{};
  std::optional<Duration> watchdog_time{};
  std::optional<std::uint32_t> watchdog_sensitivity{};
  std::optional<std::uint32_t> watchdog_omitted_cycles{};
  std::optional<WatchdogPolicy> watchdog_policy{};
  bool operator==(const TaskSettings&) const = default;
};

/// The options of the C interface, checked as far as they can be without the task. invalid_argument: the text
/// names the field and the allowed values. Set-up.
[[nodiscard]] Result<TaskSettings> from_options(const char* task, const Task_Options* options);

/// Writes `settings` into the tasks that they name. invalid_argument: there is no such task (the text lists
/// what there is), or it is not of the kind that can have this. Set-up.
[[nodiscard]] Result<void> apply_task_settings(std::span<const TaskSettings> settings,
                                               std::vector<TaskConfig>& tasks);

}  // namespace plchost
