// [DistributedClock]: how the grids of cyclic tasks follow a reference clock.
#include <array>

#include "instances/runtime/settings/settings_key.hpp"
#include "shm/pages/reference_clock.hpp"

namespace plchost {

namespace {

constexpr std::string_view kClock = "DistributedClock";
constexpr std::int64_t kNsInMs = 1'000'000;

using ClockSettings = DistributedClockSettings;

DistributedClockSettings& clock_of(const SettingsTarget& target) {
  return target.settings.scheduler.distributed_clock;
}

bool is_memory_name(std::string_view text) {
  return check_reference_name(text).has_value();
}

constexpr std::array kClockKeys = {
    SettingKey{.section = kClock,
               .name = "Reference",
               .meaning = "record that the grids of cyclic tasks follow; without it a driver reports pairs "
                          "(SchedReportReferenceTime)",
               .value = TextSetting{"name of a shared memory of the pool, 1 to 95 letters, digits, _ - .",
                                    is_memory_name,
                                    [](const SettingsTarget& to, std::string_view name) {
                                      clock_of(to).reference = name;
                                    }}},
    SettingKey{.section = kClock,
               .name = "KpPpm",
               .unit = "ppm",
               .initial = "30000",
               .meaning = "share of a pair's deviation that moves the phase",
               .value = NumberSetting{1, ClockSettings::kMaxGainPpm,
                                      [](const SettingsTarget& to, std::int64_t ppm) {
                                        clock_of(to).kp_ppm = static_cast<int>(ppm);
                                      }}},
    SettingKey{.section = kClock,
               .name = "KiPpm",
               .unit = "ppm",
               .initial = "200",
               .meaning = "share of a pair's deviation that moves the drift",
               .value = NumberSetting{0, ClockSettings::kMaxGainPpm,
                                      [](const SettingsTarget& to, std::int64_t ppm) {
                                        clock_of(to).ki_ppm = static_cast<int>(ppm);
                                      }}},
    SettingKey{.section = kClock,
               .name = "MaxCorrectionNs",
               .unit = "ns",
               .initial = "0",
               .meaning = "the most that one release is moved; 0: 1 % of the task's interval",
               .value = NumberSetting{0, ClockSettings::kMaxCorrection.count(),
                                      [](const SettingsTarget& to, std::int64_t ns) {
                                        clock_of(to).max_correction = Duration(ns);
                                      }}},
    SettingKey{.section = kClock,
               .name = "SyncWindowNs",
               .unit = "ns",
               .initial = "50000",
               .meaning = "releases no further off are in sync",
               .value = NumberSetting{1, ClockSettings::kMaxWindow.count(),
                                      [](const SettingsTarget& to, std::int64_t ns) {
                                        clock_of(to).sync_window = Duration(ns);
                                      }}},
    SettingKey{.section = kClock,
               .name = "PairToleranceNs",
               .unit = "ns",
               .initial = "2000",
               .meaning = "a pair no further off is never an outlier",
               .value = NumberSetting{1, ClockSettings::kMaxWindow.count(),
                                      [](const SettingsTarget& to, std::int64_t ns) {
                                        clock_of(to).pair_tolerance = Duration(ns);
                                      }}},
    SettingKey{.section = kClock,
               .name = "ReferenceTimeoutMs",
               .unit = "ms",
               .initial = "300",
               .meaning = "hold-over begins after this time without a pair",
               .value = NumberSetting{1, ClockSettings::kMaxTimeout.count() / kNsInMs,
                                      [](const SettingsTarget& to, std::int64_t ms) {
                                        clock_of(to).reference_timeout = std::chrono::milliseconds(ms);
                                      }}},
    SettingKey{.section = kClock,
               .name = "HoldOverMs",
               .unit = "ms",
               .initial = "10000",
               .meaning = "how long hold-over counts as in sync",
               .value = NumberSetting{0, ClockSettings::kMaxTimeout.count() / kNsInMs,
                                      [](const SettingsTarget& to, std::int64_t ms) {
                                        clock_of(to).hold_over_limit = std::chrono::milliseconds(ms);
                                      }}},
};

}  // namespace

std::span<const SettingKey> clock_keys() noexcept {
  return kClockKeys;
}

}  // namespace plchost
