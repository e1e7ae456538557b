// [DistributedClock]: how the grids of cyclic tasks follow a reference clock.
#include <array>

#include "instances/runtime/settings/reference_name.hpp"
#include "instances/runtime/settings/setting_places.hpp"
#include "instances/runtime/settings/settings_key.hpp"

namespace plchost {

namespace {

constexpr std::string_view kClock = "DistributedClock";

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using ClockSettings = DistributedClockSettings;

template <auto kMember>
using ClockAt = At<&InstanceSettings::scheduler, &SchedulerSettings::distributed_clock, kMember>;

bool is_reference(std::string_view text) {
  return parse_reference(text).has_value();
}

constexpr std::array kClockKeys = {
    SettingKey{.section = kClock,
               .name = "Reference",
               .meaning =
                   "clock or record that the grids of cyclic tasks follow; without it a driver reports "
                   "pairs (SchedReportReferenceTime)",
               .value = text_setting<ClockAt<&ClockSettings::reference>>(kReferenceForm, is_reference)},
    SettingKey{.section = kClock,
               .name = "KpPpm",
               .unit = "ppm",
               .meaning = "share of a pair's deviation that moves the phase",
               .value = number_setting<ClockAt<&ClockSettings::kp_ppm>>()},
    SettingKey{.section = kClock,
               .name = "KiPpm",
               .unit = "ppm",
               .meaning = "share of a pair's deviation that moves the drift",
               .value = number_setting<ClockAt<&ClockSettings::ki_ppm>>()},
    SettingKey{.section = kClock,
               .name = "MaxCorrectionNs",
               .unit = "ns",
               .meaning = "the most that one release is moved; 0: 1 % of the task's interval",
               .value = number_setting<ClockAt<&ClockSettings::max_correction>, As<nanoseconds>>()},
    SettingKey{.section = kClock,
               .name = "SyncWindowNs",
               .unit = "ns",
               .meaning = "releases no further off are in sync",
               .value = number_setting<ClockAt<&ClockSettings::sync_window>, As<nanoseconds>>()},
    SettingKey{.section = kClock,
               .name = "PairToleranceNs",
               .unit = "ns",
               .meaning = "a pair no further off is never an outlier",
               .value = number_setting<ClockAt<&ClockSettings::pair_tolerance>, As<nanoseconds>>()},
    SettingKey{.section = kClock,
               .name = "ReferenceTimeoutMs",
               .unit = "ms",
               .meaning = "hold-over begins after this time without a pair",
               .value = number_setting<ClockAt<&ClockSettings::reference_timeout>, As<milliseconds>>()},
    SettingKey{.section = kClock,
               .name = "HoldOverMs",
               .unit = "ms",
               .meaning = "how long hold-over counts as in sync",
               .value = number_setting<ClockAt<&ClockSettings::hold_over_limit>, As<milliseconds>>()},
};

}  // namespace

std::span<const SettingKey> clock_keys() noexcept {
  return kClockKeys;
}

}  // namespace plchost
