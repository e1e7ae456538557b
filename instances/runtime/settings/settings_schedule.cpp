// [CmpSchedule]: the schedulers and the watchdogs.
#include <array>

#include "instances/runtime/settings/settings_key.hpp"

namespace plchost {

namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr std::string_view kScheduleSection = "CmpSchedule";

constexpr std::array kScheduleKeys = {
    SettingKey{.section = kScheduleSection,
               .name = "SchedulerInterval",
               .unit = "us",
               .initial = "1000",
               .meaning = "period of the tick, and of the poll of event variables",
               .value = MicrosecondSetting{50, 1'000'000,
                                           [](const SettingsTarget& to, Duration interval) {
                                             to.settings.scheduler.scheduler_interval = interval;
                                           }}},
    SettingKey{.section = kScheduleSection,
               .name = "Task.Freewheeling.Cycletime",
               .unit = "ms",
               .initial = "-1",
               .meaning = "fixed sleep of freewheeling tasks",
               .value = OptionalNumberSetting{60'000,
                                              [](const SettingsTarget& to, std::int64_t ms) {
                                                to.settings.scheduler.freewheeling_cycletime =
                                                    milliseconds(ms < 0 ? 0 : ms);
                                              }}},
    SettingKey{.section = kScheduleSection,
               .name = "ProcessorLoad.Maximum",
               .unit = "percent, 0 is not set",
               .initial = "0",
               .meaning = "freewheeling tasks sleep the rest of their execution time, without it 20 %; limit "
                          "of the load watchdog",
               .value = NumberSetting{0, kMaxProcessorLoad,
                                      [](const SettingsTarget& to, std::int64_t percent) {
                                        to.settings.scheduler.processor_load_maximum =
                                            static_cast<int>(percent);
                                      },
                                      true}},
    SettingKey{.section = kScheduleSection,
               .name = "ProcessorLoad.Enable",
               .unit = "1 is on",
               .initial = "1",
               .meaning = "load watchdog: at ProcessorLoad.Maximum, without it at overload",
               .value = NumberSetting{0, 1,
                                      [](const SettingsTarget& to, std::int64_t on) {
                                        to.settings.scheduler.watchdog.load = on != 0;
                                      }}},
    SettingKey{.section = kScheduleSection,
               .name = "ProcessorLoad.Interval",
               .unit = "ms",
               .initial = "1000",
               .meaning = "time over which the load is measured",
               .value = NumberSetting{10, 60'000,
                                      [](const SettingsTarget& to, std::int64_t ms) {
                                        to.settings.scheduler.watchdog.load_interval = milliseconds(ms);
                                      }}},
    SettingKey{.section = kScheduleSection,
               .name = "DisableOmittedCycleWatchdog",
               .unit = "1 is disabled",
               .initial = "0",
               .meaning = "the tasks' watchdogs of omitted cycles are off",
               .value = NumberSetting{0, 1,
                                      [](const SettingsTarget& to, std::int64_t disabled) {
                                        to.settings.scheduler.watchdog.omitted_cycles = disabled == 0;
                                      }}},
    SettingKey{
        .section = kScheduleSection,
        .name = "Watchdog.DefaultTimeMs",
        .unit = "ms, 0 is off",
        .initial = "2000",
        .meaning =
            "guard against endless loops in tasks without a watchdog of their own, and against overload",
        .value =
            NumberSetting{
                0, 3'600'000,
                [](const SettingsTarget& to,
                   std::int64_t ms) { to.settings.scheduler.watchdog.default_time = milliseconds(ms); }}},
    SettingKey{
        .section = kScheduleSection,
        .name = "SpinAhead.MaxUs",
        .unit = "us, 0 is off",
        .initial = "100",
        .meaning = "bound of the guard of CmpScheduleOneShot",
        .value =
            NumberSetting{0, 1000,
                          [](const SettingsTarget& to,
                             std::int64_t us) { to.settings.scheduler.spin_ahead_max = microseconds(us); }}},
    SettingKey{
        .section = kScheduleSection,
        .name = "ExternalEvent.DeviceDescription",
        .meaning = "its external events are registered; an application that waits for another one is refused",
        .value = TextSetting{"an XML file", [](std::string_view text) { return !text.empty(); },
                             [](const SettingsTarget& to, std::string_view file) {
                               to.settings.device_description = in_folder(to, file);
                             }}},
    SettingKey{
        .section = kScheduleSection,
        .name = "ExternalEvent.MaxBacklog",
        .unit = "events",
        .initial = "1048576",
        .meaning = "posts that a task may lag behind before it drops and counts them",
        .value =
            NumberSetting{
                1,
                1'000'000'000,
                [](const SettingsTarget& to, std::int64_t events) {
                  to.settings.scheduler.max_event_backlog = static_cast<std::uint64_t>(events);
                }}},
    // The manager waits as long as the highest of them allow.
    SettingKey{.section = kScheduleSection,
               .name = "Stop.OutputsLimitMs",
               .unit = "ms",
               .initial = "10000",
               .meaning = "time in a stop for the cycles of tasks that drive outputs",
               .value = NumberSetting{1, 10'000,
                                      [](const SettingsTarget& to,
                                         std::int64_t ms) { to.settings.stop.outputs = milliseconds(ms); }}},
    SettingKey{.section = kScheduleSection,
               .name = "Stop.OthersLimitMs",
               .unit = "ms",
               .initial = "25000",
               .meaning = "time in a stop for the other tasks, which come after them",
               .value = NumberSetting{1, 25'000,
                                      [](const SettingsTarget& to,
                                         std::int64_t ms) { to.settings.stop.others = milliseconds(ms); }}},
    SettingKey{
        .section = kScheduleSection,
        .name = "Statistics.FineTasks",
        .unit = "tasks",
        .initial = "64",
        .meaning = "up to so many tasks have histograms of 3 digits (352 KiB of locked memory for "
                   "each), more have 2 (50 KiB)",
        .value =
            NumberSetting{
                0,
                kMaxTasks,
                [](const SettingsTarget& to,
                   std::int64_t tasks) { to.settings.fine_tasks = static_cast<std::uint32_t>(tasks); }}},
    // Here every scheduler times its tasks itself, without slices, and reports through the instance's log.
    SettingKey{.section = kScheduleSection, .name = "DontUseMicrosecondTiming"},
    SettingKey{.section = kScheduleSection, .name = "EnableLogger"},
    SettingKey{.section = kScheduleSection, .name = "OmittedCycleWatchdog.OnlineChangeUs"},
    SettingKey{.section = kScheduleSection, .name = "SchedulerPriority"},
    SettingKey{.section = kScheduleSection, .name = "Scheduling.Mode"},
    SettingKey{.section = kScheduleSection, .name = "Scheduling.TaskSupervisor"},
    SettingKey{.section = kScheduleSection, .name = "SupervisorTimeoutMultiplier"},
    SettingKey{.section = kScheduleSection, .name = "Timeslicing.Mode"},
    SettingKey{.section = kScheduleSection, .name = "Timeslicing.PlcSlicePercent"},
    SettingKey{.section = kScheduleSection, .name = "Timeslicing.PlcSliceUs"},
    SettingKey{.section = kScheduleSection, .name = "Timeslicing.StartOnProcessorLoad"},
    SettingKey{.section = kScheduleSection, .name = "UseWatchdogTimer"},
};

}  // namespace

std::span<const SettingKey> schedule_keys() noexcept {
  return kScheduleKeys;
}

}  // namespace plchost
