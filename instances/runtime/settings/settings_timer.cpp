// [SysTimer]: where the tick comes from. [SysTime]: the clock of the applications.
#include <algorithm>
#include <array>
#include <utility>

#include "instances/runtime/settings/setting_places.hpp"
#include "instances/runtime/settings/settings_key.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr std::string_view kTimer = "SysTimer";
constexpr std::string_view kTime = "SysTime";

// In the order of their enumerators.
constexpr std::array<std::string_view, 3> kSources = {"System", "Task", "Auxiliary"};
constexpr std::array<std::string_view, 2> kModes = {"Periodic", "OneShot"};
constexpr std::array<std::string_view, 3> kIdleStates = {"Hold", "HoldCore", "Allow"};
static_assert(std::to_underlying(TickSourceKind::auxiliary) == 2);
static_assert(std::to_underlying(TimerMode::one_shot) == 1);
static_assert(std::to_underlying(IdleStates::allow) == 2);

bool is_device_path(std::string_view text) {
  return text.starts_with('/') && text.size() <= kMaxPath;
}

bool is_symbol(std::string_view text) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  constexpr std::size_t kMaxSymbol = 255;
  return text.size() <= kMaxSymbol && is_letter(text.front()) &&
         std::ranges::all_of(text, [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); });
}

// Nothing is the default, as the other runtime has it.
bool is_symbol_or_nothing(std::string_view text) {
  return text.empty() || is_symbol(text);
}

bool is_path_or_nothing(std::string_view text) {
  return text.size() <= kMaxPath;
}

template <auto kMember>
using TickAt = At<&InstanceSettings::scheduler, kMember>;
template <auto kMember>
using TimeAt = At<&InstanceSettings::sys_time, kMember>;

constexpr std::array kTimerKeys = {
    SettingKey{.section = kTimer,
               .name = "TimerSource",
               .prefixed = true,
               .meaning = "where the tick comes from: timerfd, a thread of high priority, a clock device",
               .value = word_setting<TickAt<&SchedulerSettings::tick_source>>(kSources)},
    SettingKey{.section = kTimer,
               .name = "TimerMode",
               .prefixed = true,
               .meaning = "OneShot chooses CmpScheduleOneShot, unless a scheduler is named",
               .value = word_setting<At<&InstanceSettings::timer_mode>>(kModes)},
    SettingKey{.section = kTimer,
               .name = "AuxiliaryDevice",
               .prefixed = true,
               .meaning = "RTC or HPET; System replaces a device that cannot make the interval",
               .value = text_setting<TickAt<&SchedulerSettings::auxiliary_device>>(
                   "absolute path of a character device", is_device_path)},
    SettingKey{.section = kTimer,
               .name = "IdleStates",
               .prefixed = true,
               .meaning = "Hold: idle states of all cores are off. HoldCore: of the instance's cores, where "
                          "that is possible",
               .value = word_setting<At<&InstanceSettings::idle_states>>(kIdleStates)},
    SettingKey{.section = kTimer, .name = "WinCE.IRQNumber"},
    SettingKey{.section = kTimer, .name = "WinCE.IgnoreFailureOfIoCtrlHalTimingEnable"},
    SettingKey{.section = kTimer, .name = "WinCE.Priority"},
    SettingKey{.section = kTimer, .name = "WinCE.TimerSource"},
    SettingKey{.section = kTime,
               .name = "CustomSysTimeGetUs",
               .prefixed = true,
               .meaning = "gives the time in us that applications see; without it CLOCK_MONOTONIC",
               .value = text_setting<TimeAt<&SysTimeSettings::get_us>>("name of a C function, or nothing",
                                                                       is_symbol_or_nothing)},
    SettingKey{.section = kTime,
               .name = "CustomSysTimeGetNs",
               .prefixed = true,
               .meaning = "the same in ns; both functions belong together",
               .value = text_setting<TimeAt<&SysTimeSettings::get_ns>>("name of a C function, or nothing",
                                                                       is_symbol_or_nothing)},
    SettingKey{.section = kTime,
               .name = "CustomSysTimeLibrary",
               .prefixed = true,
               .meaning = "has both functions; without it components and preloaded libraries are searched",
               .value = TextSetting{"file of a shared object, or nothing", is_path_or_nothing,
                                    [](const SettingsTarget& to, std::string_view path) {
                                      to.settings.sys_time.library = path.empty() ? "" : in_folder(to, path);
                                    }}},
    SettingKey{.section = kTime, .name = "UseTimestamp", .prefixed = true},
    SettingKey{.section = kTime, .name = "WinCE.GetMsTimeFromSchedulerTicks"},
    SettingKey{.section = kTime, .name = "WinCE.MaxDistancePC"},
};

}  // namespace

std::span<const SettingKey> timer_keys() noexcept {
  return kTimerKeys;
}

}  // namespace plchost
