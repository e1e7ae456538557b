#include "instances/runtime/tasks/task_builder.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/tasks/task_table.hpp"
#include "shm/base/names.hpp"

namespace plchost {

static_assert(PLC_MAX_TASKS == kMaxTasks);

namespace {

std::unexpected<Error> invalid_task(std::string text) {
  return failure(ErrorCode::invalid_argument, std::move(text));
}

// A text of the ABI, which may lack its terminating zero.
template <std::size_t Size>
Result<std::string> field_text(const char (&field)[Size], std::string_view what) {
  const char* const end = std::find(std::begin(field), std::end(field), '\0');
  if (end == std::end(field)) {
    return invalid_task(
        fmt::format("{} is longer than {} characters: it has no terminating zero", what, Size - 1));
  }
  return std::string(std::begin(field), end);
}

Duration interval_of(const Task_Info& task) {
  return task.bMicroseconds != 0 ? Duration(std::chrono::microseconds(task.dwInterval))
                                 : Duration(std::chrono::milliseconds(task.dwInterval));
}

std::string known_kinds() {
  std::vector<std::string> known;
  for (const TaskKindTraits& kind : kTaskKinds)
    known.push_back(fmt::format("{} ({})", kind.name, std::to_underlying(kind.kind)));
  return fmt::format("{}", fmt::join(known, ", "));
}

// The parts that only some kinds of tasks have.
Result<void> fill_kind(const Task_Info& task, const std::shared_ptr<TaskCode>& code, TaskConfig& config) {
  const TaskKindTraits& kind = traits_of(config.kind);
  if (kind.has_interval) {
    config.interval = interval_of(task);
    if (config.interval <= Duration::zero() || config.interval > kMaxInterval)
      return invalid_task(fmt::format("dwInterval must be above 0 and at most {} days (kind {})",
                                      std::chrono::floor<std::chrono::days>(kMaxInterval).count(),
                                      kind.name));
  }
  if (kind.reads_variable) {
    if (task.dwEventFunctionPointer == nullptr)
      return invalid_task(fmt::format("dwEventFunctionPointer must not be null (kind {})", kind.name));
    code->read = task.dwEventFunctionPointer;
    config.event_variable = [code] {
      const CurrentTask current(code->info);
      return code->read() != 0;
    };
  }
  if (kind.names_event) {
    PLCHOST_TRY_ASSIGN(const auto event, field_text(task.stExternalEvent, "stExternalEvent"));
    config.external_event = event;
    return check_name("stExternalEvent", event, kMaxEventName);
  }
  return {};
}

Result<TaskConfig> build_task(Task_Info& task, const std::shared_ptr<TaskCode>& code) {
  if (task.nPriority < 0 || task.nPriority > kLowestIecPriority) {
    return invalid_task(
        fmt::format("nPriority {} is not allowed: 0 (highest) to {} is", task.nPriority, kLowestIecPriority));
  }
  const auto kind = static_cast<TaskKind>(task.KindOfTask);
  if (find_traits(kind) == nullptr) {
    return invalid_task(
        fmt::format("KindOfTask {} is not allowed; allowed are {}", task.KindOfTask, known_kinds()));
  }
  if (task.dwTaskEntryFunctionPointer == nullptr) return invalid_task("dwTaskEntryFunctionPointer is null");
  TaskConfig config;
  config.kind = kind;
  config.iec_priority = task.nPriority;
  *code = {.info = &task, .run = task.dwTaskEntryFunctionPointer};
  config.entry = [code] {
    const CurrentTask current(code->info);
    code->run();
  };
  config.after_cycle = [code](const TaskCounters& counters) { write_back(counters, *code->info); };
  PLCHOST_TRY(fill_kind(task, code, config));
  return config;
}

Result<void> check_ranges(const Task_Options& options) {
  if (options.dwSize != sizeof(Task_Options)) {
    return invalid_task(fmt::format("dwSize is {}: sizeof(Task_Options), {}, is allowed", options.dwSize,
                                    sizeof(Task_Options)));
  }
  if (options.nStartOffsetNs < 0) {
    return invalid_task(fmt::format("nStartOffsetNs is {}: 0 and more is allowed", options.nStartOffsetNs));
  }
  if (options.nLatePolicy != PLC_LATE_NEXT && options.nLatePolicy != PLC_LATE_ASAP) {
    return invalid_task(fmt::format("nLatePolicy is {}: PLC_LATE_NEXT (0) and PLC_LATE_ASAP (1) are allowed",
                                    options.nLatePolicy));
  }
  if (options.bDrivesOutputs > 1) {
    return invalid_task(fmt::format("bDrivesOutputs is {}: 0 and 1 are allowed", options.bDrivesOutputs));
  }
  for (const auto& [name, value] : {std::pair{"dwWatchdogSensitivity", options.dwWatchdogSensitivity},
                                    std::pair{"dwWatchdogOmittedCycles", options.dwWatchdogOmittedCycles}}) {
    if (value > kMaxWatchdogCount) {
      return invalid_task(fmt::format("{} is {}: 0 to {} is allowed", name, value, kMaxWatchdogCount));
    }
  }
  if (options.nWatchdogPolicy != PLC_WATCHDOG_APPLICATION && options.nWatchdogPolicy != PLC_WATCHDOG_TASK) {
    return invalid_task(fmt::format(
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

Result<std::vector<TaskConfig>> build_tasks(const sys_setup_tasks_struct& setup) {
  TaskCodes codes;
  return build_tasks(setup, codes);
}

Result<std::vector<TaskConfig>> build_tasks(const sys_setup_tasks_struct& setup, TaskCodes& codes) {
  if (setup.nTasks < 1 || setup.nTasks > PLC_MAX_TASKS) {
    return invalid_task(fmt::format("the application has {} tasks (nTasks); allowed are 1 to {}",
                                    setup.nTasks, PLC_MAX_TASKS));
  }
  if (setup.ptaskinfo == nullptr) return invalid_task("ptaskinfo is null");
  PLCHOST_TRY(field_text(setup.stApplicationName, "stApplicationName"));
  std::vector<TaskConfig> configs;
  std::set<std::string> names;
  for (int i = 0; i < setup.nTasks; ++i) {
    Task_Info& task = setup.ptaskinfo[i];
    PLCHOST_TRY_ASSIGN(const auto name,
                       in_step(fmt::format("task number {}", i), field_text(task.stName, "stName")));
    PLCHOST_TRY(in_step(fmt::format("task number {}", i), check_name("stName", name, kMaxTaskName)));
    if (!names.insert(name).second) return invalid_task(fmt::format("two tasks are called '{}'", name));
    PLCHOST_TRY_ASSIGN(auto config,
                       in_step(fmt::format("task '{}'", name),
                               build_task(task, codes.emplace_back(std::make_shared<TaskCode>()))));
    config.name = name;
    configs.push_back(std::move(config));
  }
  return configs;
}

Result<TaskSettings> from_options(const char* task, const Task_Options* options) {
  if (task == nullptr || options == nullptr) return invalid_task("a null pointer");
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
      return invalid_task(fmt::format("{}: the application has no task '{}'; its tasks are {}", from.where,
                                      from.task, names_of(tasks)));
    }
    write(from, *task);
    PLCHOST_TRY(in_step(from.where, check_task(*task)));
  }
  return {};
}

void write_back(const TaskCounters& counters, Task_Info& task) noexcept {
  constexpr std::int64_t kPerUs = 1000;
  const auto us = [](std::int64_t ns) {
    constexpr std::int64_t kLowest = std::numeric_limits<int>::min();
    constexpr std::int64_t kHighest = std::numeric_limits<int>::max();
    return static_cast<int>(std::clamp(ns / kPerUs, kLowest, kHighest));
  };
  task.tLastCycleTime = us(counters.exec_last_ns);
  task.tAverageCycleTime = us(average(counters.exec_sum_ns, counters.recorded));
  task.tMaxCycleTime = us(counters.exec_max_ns);
  task.tMinCycleTime = us(counters.exec_min_ns);
  task.tJitterMax = us(largest_jitter_ns(counters));
  task.tJitterLast = us(counters.jitter_last_ns);
}

TaskIdentity identity_of(const TaskConfig& task) {
  TaskIdentity identity;
  identity.name.assign(task.name);
  identity.external_event.assign(task.external_event);
  identity.kind = task.kind;
  identity.iec_priority = task.iec_priority;
  identity.interval_ns = task.interval.count();
  return identity;
}

}  // namespace plchost
