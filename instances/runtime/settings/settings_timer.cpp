// [SysTimer]: where the tick comes from. [SysTime]: the clock of the applications.
#include <algorithm>
#include <array>
#include <utility>

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

constexpr std::array kTimerKeys = {
    SettingKey{.section = kTimer,
               .name = "TimerSource",
               .prefixed = true,
               .initial = "System",
               .meaning = "where the tick comes from: timerfd, a thread of high priority, a clock device",
               .value = WordSetting{kSources,
                                    [](const SettingsTarget& to, std::size_t index) {
                                      to.settings.scheduler.tick_source = static_cast<TickSourceKind>(index);
                                    }}},
    SettingKey{.section = kTimer,
               .name = "TimerMode",
               .prefixed = true,
               .initial = "Periodic",
               .meaning = "OneShot chooses CmpScheduleOneShot, unless a scheduler is named",
               .value = WordSetting{kModes,
                                    [](const SettingsTarget& to, std::size_t index) {
                                      to.settings.timer_mode = static_cast<TimerMode>(index);
                                    }}},
    SettingKey{.section = kTimer,
               .name = "AuxiliaryDevice",
               .prefixed = true,
               .initial = "/dev/rtc0",
               .meaning = "RTC or HPET; System replaces a device that cannot make the interval",
               .value = TextSetting{"absolute path of a character device", is_device_path,
                                    [](const SettingsTarget& to, std::string_view path) {
                                      to.settings.scheduler.auxiliary_device = path;
                                    }}},
    SettingKey{.section = kTimer,
               .name = "IdleStates",
               .prefixed = true,
               .initial = "Hold",
               .meaning = "Hold: idle states of all cores are off. HoldCore: of the instance's cores, where "
                          "that is possible",
               .value = WordSetting{kIdleStates,
                                    [](const SettingsTarget& to, std::size_t index) {
                                      to.settings.idle_states = static_cast<IdleStates>(index);
                                    }}},
    SettingKey{.section = kTimer, .name = "WinCE.IRQNumber"},
    SettingKey{.section = kTimer, .name = "WinCE.IgnoreFailureOfIoCtrlHalTimingEnable"},
    SettingKey{.section = kTimer, .name = "WinCE.Priority"},
    SettingKey{.section = kTimer, .name = "WinCE.TimerSource"},
    SettingKey{.section = kTime,
               .name = "CustomSysTimeGetUs",
               .prefixed = true,
               .meaning = "gives the time in us that applications see; without it CLOCK_MONOTONIC",
               .value = TextSetting{"name of a C function, or nothing", is_symbol_or_nothing,
                                    [](const SettingsTarget& to, std::string_view symbol) {
                                      to.settings.sys_time.get_us = symbol;
                                    }}},
    SettingKey{.section = kTime,
               .name = "CustomSysTimeGetNs",
               .prefixed = true,
               .meaning = "the same in ns; both functions belong together",
               .value = TextSetting{"name of a C function, or nothing", is_symbol_or_nothing,
                                    [](const SettingsTarget& to, std::string_view symbol) {
                                      to.settings.sys_time.get_ns = symbol;
                                    }}},
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
