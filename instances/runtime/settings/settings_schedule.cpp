// [CmpSchedule]: the schedulers and the watchdogs.
#include <array>

#include "instances/runtime/settings/setting_places.hpp"
#include "instances/runtime/settings/settings_key.hpp"
#include "shm/base/bounds.hpp"
#include "shm/base/stop_limits.hpp"
#include "shm/pages/instance_page.hpp"

namespace plchost {

namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr std::string_view kScheduleSection = "CmpSchedule";

constexpr Bounds<Duration> kStopOfOutputs{.lowest = milliseconds(1), .highest = kMaxStopOfOutputs};
constexpr Bounds<Duration> kStopOfOthers{.lowest = milliseconds(1), .highest = kMaxStopOfOthers};

template <auto kMember>
using ScheduleAt = At<&InstanceSettings::scheduler, kMember>;
template <auto kMember>
using WatchdogAt = At<&InstanceSettings::scheduler, &SchedulerSettings::watchdog, kMember>;
template <auto kMember>
using StopAt = At<&InstanceSettings::stop, kMember>;

constexpr std::array kScheduleKeys = {
    SettingKey{.section = kScheduleSection,
               .name = "SchedulerInterval",
               .unit = "us",
               .meaning = "period of the tick, and of the poll of event variables",
               .value = microsecond_setting<ScheduleAt<&SchedulerSettings::scheduler_interval>>()},
    SettingKey{.section = kScheduleSection,
               .name = "Task.Freewheeling.Cycletime",
               .unit = "ms",
               .meaning = "fixed sleep of freewheeling tasks",
               .value = optional_number_setting<ScheduleAt<&SchedulerSettings::freewheeling_cycletime>,
                                                As<milliseconds>>()},
    SettingKey{.section = kScheduleSection,
               .name = "ProcessorLoad.Maximum",
               .unit = "percent, 0 is not set",
               .meaning = "freewheeling tasks sleep the rest of their execution time, without it 20 %; limit "
                          "of the load watchdog",
               .value = number_setting<ScheduleAt<&SchedulerSettings::processor_load_maximum>>(true)},
    SettingKey{.section = kScheduleSection,
               .name = "ProcessorLoad.Enable",
               .unit = "1 is on",
               .meaning = "load watchdog: at ProcessorLoad.Maximum, without it at overload",
               .value = truth_setting<WatchdogAt<&WatchdogSettings::load>>()},
    SettingKey{.section = kScheduleSection,
               .name = "ProcessorLoad.Interval",
               .unit = "ms",
               .meaning = "time over which the load is measured",
               .value = number_setting<WatchdogAt<&WatchdogSettings::load_interval>, As<milliseconds>>()},
    SettingKey{.section = kScheduleSection,
               .name = "DisableOmittedCycleWatchdog",
               .unit = "1 is disabled",
               .meaning = "the tasks' watchdogs of omitted cycles are off",
               .value = truth_setting<WatchdogAt<&WatchdogSettings::omitted_cycles>, AsOpposite>()},
    SettingKey{
        .section = kScheduleSection,
        .name = "Watchdog.DefaultTimeMs",
        .unit = "ms, 0 is off",
        .meaning =
            "guard against endless loops in tasks without a watchdog of their own, and against overload",
        .value = number_setting<WatchdogAt<&WatchdogSettings::default_time>, As<milliseconds>>()},
    SettingKey{.section = kScheduleSection,
               .name = "SpinAhead.MaxUs",
               .unit = "us, 0 is off",
               .meaning = "bound of the guard of CmpScheduleOneShot",
               .value = number_setting<ScheduleAt<&SchedulerSettings::spin_ahead_max>, As<microseconds>>()},
    SettingKey{
        .section = kScheduleSection,
        .name = "ExternalEvent.DeviceDescription",
        .meaning = "its external events are registered; an application that waits for another one is refused",
        .value = TextSetting{"an XML file", [](std::string_view text) { return !text.empty(); },
                             [](const SettingsTarget& to, std::string_view file) {
                               to.settings.device_description = in_folder(to, file);
                             }}},
    SettingKey{.section = kScheduleSection,
               .name = "ExternalEvent.MaxBacklog",
               .unit = "events",
               .meaning = "posts that a task may lag behind before it drops and counts them",
               .value = number_setting<ScheduleAt<&SchedulerSettings::max_event_backlog>>()},
    SettingKey{.section = kScheduleSection,
               .name = "Stop.OutputsLimitMs",
               .unit = "ms",
               .meaning = "time in a stop for the cycles of tasks that drive outputs",
               .value = number_setting<StopAt<&StopLimits::outputs>, As<milliseconds>>(kStopOfOutputs)},
    SettingKey{.section = kScheduleSection,
               .name = "Stop.OthersLimitMs",
               .unit = "ms",
               .meaning = "time in a stop for the other tasks, which come after them",
               .value = number_setting<StopAt<&StopLimits::others>, As<milliseconds>>(kStopOfOthers)},
    SettingKey{.section = kScheduleSection,
               .name = "Statistics.FineTasks",
               .unit = "tasks",
               .meaning = "up to so many tasks have histograms of 3 digits (352 KiB of locked memory for "
                          "each), more have 2 (50 KiB)",
               .value = number_setting<At<&InstanceSettings::fine_tasks>>(0, kMaxTasks)},
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
