#include "instances/runtime/settings/task_settings.hpp"

#include <algorithm>
#include <cstring>
#include <string_view>

#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

std::unexpected<Error> invalid(std::string text) {
  return failure(ErrorCode::invalid_argument, std::move(text));
}

Result<void> check_ranges(const Task_Options& options) {
  if (options.dwSize != sizeof(Task_Options)) {
    return invalid(fmt::format("dwSize is {}: sizeof(Task_Options), {}, is allowed", options.dwSize,
                               sizeof(Task_Options)));
  }
  if (options.nStartOffsetNs < 0) {
    return invalid(fmt::format("nStartOffsetNs is {}: 0 and more is allowed", options.nStartOffsetNs));
  }
  if (options.nLatePolicy != PLC_LATE_NEXT && options.nLatePolicy != PLC_LATE_ASAP) {
    return invalid(fmt::format("nLatePolicy is {}: PLC_LATE_NEXT (0) and PLC_LATE_ASAP (1) are allowed",
                               options.nLatePolicy));
  }
  if (options.bDrivesOutputs > 1) {
    return invalid(fmt::format("bDrivesOutputs is {}: 0 and 1 are allowed", options.bDrivesOutputs));
  }
  for (const auto& [name, value] : {std::pair{"dwWatchdogSensitivity", options.dwWatchdogSensitivity},
                                    std::pair{"dwWatchdogOmittedCycles", options.dwWatchdogOmittedCycles}}) {
    if (value > kMaxWatchdogCount) {
      return invalid(fmt::format("{} is {}: 0 to {} is allowed", name, value, kMaxWatchdogCount));
    }
  }
  if (options.nWatchdogPolicy != PLC_WATCHDOG_APPLICATION && options.nWatchdogPolicy != PLC_WATCHDOG_TASK) {
    return invalid(fmt::format(
        "nWatchdogPolicy is {}: PLC_WATCHDOG_APPLICATION (0) and PLC_WATCHDOG_TASK (1) are allowed",
        options.nWatchdogPolicy));
  }
  return {};
}

template <class T>
void take(const std::optional<T>& from, T& to) {
  if (from) to = *from;
}

void write(const TaskSettings& from, TaskConfig& to) {
  take(from.late, to.late);
  take(from.start_offset, to.start_offset);
  take(from.drives_outputs, to.drives_outputs);
  take(from.watchdog_time, to.watchdog.time);
  take(from.watchdog_sensitivity, to.watchdog.sensitivity);
  take(from.watchdog_omitted_cycles, to.watchdog.omitted_cycles);
  take(from.watchdog_policy, to.watchdog.policy);
}

std::string names_of(const std::vector<TaskConfig>& tasks) {
  std::vector<std::string_view> names;
  for (const TaskConfig& task : tasks) names.emplace_back(task.name);
  return join_names(names);
}

}  // namespace

Result<TaskSettings> from_options(const char* task, const Task_Options* options) {
  if (task == nullptr || options == nullptr) return invalid("a null pointer");
  const std::string_view name(task, ::strnlen(task, kMaxTaskName + 1));
  PLCHOST_TRY(check_name("task", name, kMaxTaskName));
  PLCHOST_TRY(check_ranges(*options));
  return TaskSettings{
      .task = std::string(name),
      .where = fmt::format("plc_set_task_options(\"{}\")", name),
      .late = options->nLatePolicy == PLC_LATE_ASAP ? LatePolicy::asap : LatePolicy::next,
      .start_offset = Duration(options->nStartOffsetNs),
      .drives_outputs = options->bDrivesOutputs != 0,
      .watchdog_time = std::chrono::microseconds(options->dwWatchdogTimeUs),
      .watchdog_sensitivity = std::max(options->dwWatchdogSensitivity, 1U),
      .watchdog_omitted_cycles = options->dwWatchdogOmittedCycles,
      .watchdog_policy =
          options->nWatchdogPolicy == PLC_WATCHDOG_TASK ? WatchdogPolicy::task : WatchdogPolicy::application,
  };
}

Result<void> apply_task_settings(std::span<const TaskSettings> settings, std::vector<TaskConfig>& tasks) {
  for (const TaskSettings& from : settings) {
    const auto task = std::ranges::find(tasks, from.task, &TaskConfig::name);
    if (task == tasks.end()) {
      return invalid(fmt::format("{}: the application has no task '{}'; its tasks are {}", from.where,
                                 from.task, names_of(tasks)));
    }
    write(from, *task);
    if (auto valid = check_task(*task); !valid) return failure_in(from.where, std::move(valid).error());
  }
  return {};
}

}  // namespace plchost
