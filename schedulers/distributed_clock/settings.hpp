#pragma once

#include <string>

#include "shm/base/bounds.hpp"
#include "shm/base/time.hpp"

namespace plchost {

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

  std::string reference;      ///< name of the reference record in the pool; empty: the application reports
  int kp_ppm = 30'000;        ///< share of a pair's deviation that moves the phase
  int ki_ppm = 200;           ///< share that moves the drift
  Duration max_correction{};  ///< of one release, either way; 0: 1 % of the task's interval
  Duration sync_window = std::chrono::microseconds(50);         ///< in sync: no further off than this
  Duration pair_tolerance = std::chrono::microseconds(2);       ///< a pair no further off is never an outlier
  Duration reference_timeout = std::chrono::milliseconds(300);  ///< without a pair, then: hold-over
  Duration hold_over_limit = std::chrono::seconds(10);          ///< in hold-over this long still in sync
  bool operator==(const DistributedClockSettings&) const = default;
};

}  // namespace plchost
