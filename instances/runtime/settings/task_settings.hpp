#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "schedulers/settings/task_options.hpp"
#include "shm/base/time.hpp"

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

}  // namespace plchost
