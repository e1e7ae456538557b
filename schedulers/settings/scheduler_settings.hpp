#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "shm/base/bounds.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

// The ranges of the settings. check_settings() allows programs more of the first two: tests have ticks of
// 20 us.
inline constexpr Bounds<Duration> kTickInFiles{.lowest = std::chrono::microseconds(50),
                                               .highest = std::chrono::seconds(1)};
inline constexpr Bounds<Duration> kFreewheelingCycletimeInFiles{.lowest = Duration(0),
                                                                .highest = std::chrono::seconds(60)};
/// 100: a freewheeling task sleeps no longer than it must.
inline constexpr Bounds<int> kProcessorLoad{.lowest = 0, .highest = 100};
/// More than any wake-up latency that spinning is an answer to.
inline constexpr Bounds<Duration> kSpinAhead{.lowest = Duration(0), .highest = std::chrono::milliseconds(1)};
inline constexpr Bounds<std::uint64_t> kEventBacklog{.lowest = 1, .highest = 1'000'000'000};

/// system: a timer of the kernel. task: a thread of high priority in absolute sleeps. auxiliary: a clock
/// device with an interrupt of its own.
enum class TickSourceKind : std::uint8_t { system, task, auxiliary };

/// How the releases of cyclic tasks follow a reference clock: [DistributedClock]. The meaning of the gains:
/// see ClockRegulator.
struct DistributedClockSettings {
  static constexpr Bounds<int> kKpPpm{.lowest = 1, .highest = 1'000'000};
  static constexpr Bounds<int> kKiPpm{.lowest = 0, .highest = 1'000'000};
  static constexpr Bounds<Duration> kMaxCorrection{.lowest = Duration(0),
                                                   .highest = std::chrono::milliseconds(100)};
  static constexpr Bounds<Duration> kWindow{.lowest = Duration(1), .highest = std::chrono::seconds(1)};
  static constexpr Bounds<Duration> kReferenceTimeout{.lowest = std::chrono::milliseconds(1),
                                                      .highest = std::chrono::hours(1)};
  static constexpr Bounds<Duration> kHoldOver{.lowest = Duration(0), .highest = std::chrono::hours(1)};

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

/// invalid_argument: a value is out of its range; the text says which and what is allowed.
[[nodiscard]] Result<void> check_settings(const SchedulerSettings& settings);

}  // namespace plchost
