// [Task.NAME]: the options of one task. They win over those that the application gives itself.
#include <array>
#include <utility>

#include "instances/runtime/settings/setting_places.hpp"
#include "instances/runtime/settings/settings_key.hpp"

namespace plchost {

namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

// In the order of their enumerators.
constexpr std::array<std::string_view, 2> kLatePolicies = {"Next", "Asap"};
constexpr std::array<std::string_view, 2> kWatchdogPolicies = {"Application", "Task"};
static_assert(std::to_underlying(LatePolicy::asap) == 1);
static_assert(std::to_underlying(WatchdogPolicy::task) == 1);

template <auto kOption, auto kMember>
using TaskWatchdogAt = AtTask<kOption, &TaskOptions::watchdog, kMember>;

constexpr std::array kTaskKeys = {
    SettingKey{
        .section = kTaskSections,
        .name = "LatePolicy",
        .meaning = "releases that passed while the task was busy: all lost, or the last one runs at once",
        .value = word_setting<AtTask<&TaskSettings::late, &TaskOptions::late>>(kLatePolicies)},
    SettingKey{
        .section = kTaskSections,
        .name = "StartOffsetNs",
        .unit = "ns, below the task's interval",
        .meaning = "phase of the task on its grid",
        .value =
            number_setting<AtTask<&TaskSettings::start_offset, &TaskOptions::start_offset>, As<nanoseconds>>(
                0, kMaxInterval / nanoseconds(1))},
    SettingKey{.section = kTaskSections,
               .name = "DrivesOutputs",
               .unit = "1 is yes",
               .meaning = "its cycles end first in a stop",
               .value = truth_setting<AtTask<&TaskSettings::drives_outputs, &TaskOptions::drives_outputs>>()},
    SettingKey{.section = kTaskSections,
               .name = "Watchdog.TimeUs",
               .unit = "us, 0 is none",
               .meaning = "longest time of a cycle",
               .value = number_setting<TaskWatchdogAt<&TaskSettings::watchdog_time, &TaskWatchdog::time>,
                                       As<microseconds>>(0, kMaxWatchdogTime / microseconds(1))},
    SettingKey{
        .section = kTaskSections,
        .name = "Watchdog.Sensitivity",
        .unit = "cycles",
        .meaning = "overruns in a row that are a hit; so is one cycle of this many times the time",
        .value =
            number_setting<TaskWatchdogAt<&TaskSettings::watchdog_sensitivity, &TaskWatchdog::sensitivity>>(
                kWatchdogSensitivity)},
    SettingKey{.section = kTaskSections,
               .name = "Watchdog.OmittedCycles",
               .unit = "cycles, 0 is off",
               .meaning = "releases in a row without a cycle that are a hit",
               .value = number_setting<
                   TaskWatchdogAt<&TaskSettings::watchdog_omitted_cycles, &TaskWatchdog::omitted_cycles>>(
                   0, kMaxWatchdogCount)},
    SettingKey{.section = kTaskSections,
               .name = "Watchdog.Policy",
               .meaning = "the object that a fault or a hit stops",
               .value = word_setting<TaskWatchdogAt<&TaskSettings::watchdog_policy, &TaskWatchdog::policy>>(
                   kWatchdogPolicies)},
};

}  // namespace

std::span<const SettingKey> task_keys() noexcept {
  return kTaskKeys;
}

}  // namespace plchost
