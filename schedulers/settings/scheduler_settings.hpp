#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include "schedulers/settings/task_options.hpp"
#include "shm/base/bounds.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// system: a timer of the kernel. task: a thread of high priority in absolute sleeps. auxiliary: a clock
/// device with an interrupt of its own.
enum class TickSourceKind : std::uint8_t { system, task, auxiliary };

/// How the releases of cyclic tasks follow a reference clock: [DistributedClock]. The meaning of the gains:
/// see ClockRegulator.
struct DistributedClockSettings {
  std::string reference;      ///< as [DistributedClock] Reference names it; empty: the application reports
  int kp_ppm = 30'000;        ///< share of a pair's deviation that moves the phase
  int ki_ppm = 200;           ///< share that moves the drift
  Duration max_correction{};  ///< of one release, either way; 0: 1 % of the task's interval
  Duration sync_window = std::chrono::microseconds(50);         ///< in sync: no further off than this
  Duration pair_tolerance = std::chrono::microseconds(2);       ///< a pair no further off is never an outlier
  Duration reference_timeout = std::chrono::milliseconds(300);  ///< without a pair, then: hold-over
  Duration hold_over_limit = std::chrono::seconds(10);          ///< in hold-over this long still in sync
  bool operator==(const DistributedClockSettings&) const = default;
};

/// The watchdogs that concern the instance as a whole.
struct WatchdogSettings {
  bool load =
      true;  ///< the load watchdog: at processor_load_maximum percent, or if that is not set at overload
  Duration load_interval = std::chrono::seconds(1);  ///< over which the load is measured
  bool omitted_cycles = true;                        ///< the tasks' watchdogs of omitted cycles may hit
  Duration default_time = std::chrono::seconds(2);   ///< of an endless loop in a task without a time; 0: off
  bool operator==(const WatchdogSettings&) const = default;
};

/// The settings of [CmpSchedule] and [SysTimer], already validated by their reader.
struct SchedulerSettings {
  Duration scheduler_interval =
      std::chrono::milliseconds(1);   ///< the tick, and how often event variables are polled
  Duration freewheeling_cycletime{};  ///< fixed sleep of freewheeling tasks; 0: a share of the execution time
  int processor_load_maximum =
      0;  ///< percent, 1..100; freewheeling tasks sleep (100-M) %; 0: not set, sleep 20 %
  TickSourceKind tick_source = TickSourceKind::system;
  std::string auxiliary_device = "/dev/rtc0";  ///< of TickSourceKind::auxiliary
  Duration spin_ahead_max =
      std::chrono::microseconds(100);  ///< bound of the guard of CmpScheduleOneShot; 0: off
  std::uint64_t max_event_backlog = std::uint64_t{1}
                                    << 20;  ///< external events a task may lag behind before it drops
  DistributedClockSettings distributed_clock;
  WatchdogSettings watchdog;
  bool operator==(const SchedulerSettings&) const = default;
};

/// The range of a setting, by the path to its member: of its key in files, and of programs.
template <auto... kPath>
struct SettingRange {
  using Value = std::remove_cvref_t<decltype((std::declval<const SchedulerSettings&>().*....*kPath))>;
  std::string_view name;
  Bounds<Value> in_files;
  Bounds<Value> in_programs = in_files;
  std::string_view zero{};  ///< the meaning of 0, if that is a value of its own
  [[nodiscard]] static constexpr Value of(const SchedulerSettings& settings) {
    return (settings.*....*kPath);
  }
};
template <auto kMember>
using ScheduleRange = SettingRange<kMember>;
template <auto kMember>
using ClockRange = SettingRange<&SchedulerSettings::distributed_clock, kMember>;
template <auto kMember>
using WatchdogRange = SettingRange<&SchedulerSettings::watchdog, kMember>;

/// A row for each setting with a range. Both its key in instances/runtime/settings/ and check_settings() read
/// it.
inline constexpr std::tuple kSettingRanges{
    // Tests have ticks of 20 us.
    ScheduleRange<&SchedulerSettings::scheduler_interval>{
        .name = "scheduler_interval",
        .in_files = {std::chrono::microseconds(50), std::chrono::seconds(1)},
        .in_programs = {Duration(1), kMaxInterval}},
    ScheduleRange<&SchedulerSettings::freewheeling_cycletime>{
        .name = "freewheeling_cycletime",
        .in_files = {Duration(0), std::chrono::seconds(60)},
        .in_programs = {Duration(0), kMaxInterval},
        .zero = "not set"},
    // 100: a freewheeling task sleeps no longer than it must.
    ScheduleRange<&SchedulerSettings::processor_load_maximum>{
        .name = "processor_load_maximum", .in_files = {0, 100}, .zero = "not set"},
    // More than any wake-up latency that spinning is an answer to.
    ScheduleRange<&SchedulerSettings::spin_ahead_max>{
        .name = "spin_ahead_max", .in_files = {Duration(0), std::chrono::milliseconds(1)}, .zero = "off"},
    ScheduleRange<&SchedulerSettings::max_event_backlog>{.name = "max_event_backlog",
                                                         .in_files = {1, 1'000'000'000}},
    ClockRange<&DistributedClockSettings::kp_ppm>{.name = "distributed_clock.kp_ppm",
                                                  .in_files = {1, 1'000'000}},
    ClockRange<&DistributedClockSettings::ki_ppm>{.name = "distributed_clock.ki_ppm",
                                                  .in_files = {0, 1'000'000}},
    ClockRange<&DistributedClockSettings::max_correction>{
        .name = "distributed_clock.max_correction",
        .in_files = {Duration(0), std::chrono::milliseconds(100)},
        .zero = "1 % of the interval"},
    ClockRange<&DistributedClockSettings::sync_window>{.name = "distributed_clock.sync_window",
                                                       .in_files = {Duration(1), std::chrono::seconds(1)}},
    ClockRange<&DistributedClockSettings::pair_tolerance>{.name = "distributed_clock.pair_tolerance",
                                                          .in_files = {Duration(1), std::chrono::seconds(1)}},
    ClockRange<&DistributedClockSettings::reference_timeout>{
        .name = "distributed_clock.reference_timeout",
        .in_files = {std::chrono::milliseconds(1), std::chrono::hours(1)}},
    ClockRange<&DistributedClockSettings::hold_over_limit>{.name = "distributed_clock.hold_over_limit",
                                                           .in_files = {Duration(0), std::chrono::hours(1)}},
    WatchdogRange<&WatchdogSettings::load_interval>{
        .name = "watchdog.load_interval",
        .in_files = {std::chrono::milliseconds(10), std::chrono::seconds(60)},
        .in_programs = {Duration(1), kMaxInterval}},
    WatchdogRange<&WatchdogSettings::default_time>{.name = "watchdog.default_time",
                                                   .in_files = {Duration(0), std::chrono::hours(1)},
                                                   .in_programs = {Duration(0), kMaxInterval},
                                                   .zero = "off"},
};

/// invalid_argument: a value is out of its range; the text says which and what is allowed.
[[nodiscard]] Result<void> check_settings(const SchedulerSettings& settings);

}  // namespace plchost
