// [Task.NAME]: the options of one task. They win over those that the application gives itself.
#include <array>
#include <utility>

#include "instances/runtime/settings/settings_key.hpp"

namespace plchost {

namespace {

// In the order of their enumerators.
constexpr std::array<std::string_view, 2> kLatePolicies = {"Next", "Asap"};
constexpr std::array<std::string_view, 2> kWatchdogPolicies = {"Application", "Task"};
static_assert(std::to_underlying(LatePolicy::asap) == 1);
static_assert(std::to_underlying(WatchdogPolicy::task) == 1);

constexpr std::array kTaskKeys = {
    SettingKey{.section = kTaskSections,
               .name = "LatePolicy",
               .initial = "Next",
               .meaning = "a late cycle: at the next release of the grid, or immediately",
               .value = WordSetting{kLatePolicies,
                                    [](const SettingsTarget& to, std::size_t index) {
                                      to.task->late = static_cast<LatePolicy>(index);
                                    }}},
    SettingKey{.section = kTaskSections,
               .name = "StartOffsetNs",
               .unit = "ns, below the task's interval",
               .initial = "0",
               .meaning = "phase of the task on its grid",
               .value = NumberSetting{0, kMaxInterval.count(),
                                      [](const SettingsTarget& to, std::int64_t ns) {
                                        to.task->start_offset = Duration(ns);
                                      }}},
    SettingKey{.section = kTaskSections,
               .name = "DrivesOutputs",
               .unit = "1 is yes",
               .initial = "0",
               .meaning = "its cycles end first in a stop",
               .value = NumberSetting{0, 1,
                                      [](const SettingsTarget& to, std::int64_t yes) {
                                        to.task->drives_outputs = yes != 0;
                                      }}},
    SettingKey{.section = kTaskSections,
               .name = "Watchdog.TimeUs",
               .unit = "us, 0 is none",
               .initial = "0",
               .meaning = "longest time of a cycle",
               .value = NumberSetting{0, kMaxWatchdogTime / std::chrono::microseconds(1),
                                      [](const SettingsTarget& to, std::int64_t us) {
                                        to.task->watchdog_time = std::chrono::microseconds(us);
                                      }}},
    SettingKey{.section = kTaskSections,
               .name = "Watchdog.Sensitivity",
               .unit = "cycles",
               .initial = "1",
               .meaning = "overruns in a row that are a hit; so is one cycle of this many times the time",
               .value = NumberSetting{1, kMaxWatchdogCount,
                                      [](const SettingsTarget& to, std::int64_t cycles) {
                                        to.task->watchdog_sensitivity = static_cast<std::uint32_t>(cycles);
                                      }}},
    SettingKey{.section = kTaskSections,
               .name = "Watchdog.OmittedCycles",
               .unit = "cycles, 0 is off",
               .initial = "0",
               .meaning = "releases in a row without a cycle that are a hit",
               .value = NumberSetting{0, kMaxWatchdogCount,
                                      [](const SettingsTarget& to, std::int64_t cycles) {
                                        to.task->watchdog_omitted_cycles = static_cast<std::uint32_t>(cycles);
                                      }}},
    SettingKey{
        .section = kTaskSections,
        .name = "Watchdog.Policy",
        .initial = "Application",
        .meaning = "the object that a fault or a hit stops",
        .value =
            WordSetting{
                kWatchdogPolicies,
                [](const SettingsTarget& to,
                   std::size_t index) { to.task->watchdog_policy = static_cast<WatchdogPolicy>(index); }}},
};

}  // namespace

std::span<const SettingKey> task_keys() noexcept {
  return kTaskKeys;
}

}  // namespace plchost
