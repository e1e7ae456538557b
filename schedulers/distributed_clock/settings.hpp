#pragma once

#include <string>

#include "shm/base/time.hpp"

namespace plchost {

/// How the releases of cyclic tasks follow a reference clock: [DistributedClock]. The meaning of the gains:
/// see ClockRegulator.
struct DistributedClockSettings {
  static constexpr int kMaxGainPpm = 1'000'000;
  static constexpr Duration kMaxCorrection = std::chrono::milliseconds(100);
  static constexpr Duration kMaxWindow = std::chrono::seconds(1);
  static constexpr Duration kMaxTimeout = std::chrono::hours(1);

  std::string reference;      ///< name of the reference record in the pool; empty: the application reports
  int kp_ppm = 30'000;        ///< share of a pair's deviation that moves the phase, 1 to 1,000,000 ppm
  int ki_ppm = 200;           ///< share that moves the drift, 0 to 1,000,000 ppm
  Duration max_correction{};  ///< of one release, either way; 0: 1 % of the task's interval
  Duration sync_window = std::chrono::microseconds(50);         ///< in sync: no further off than this
  Duration pair_tolerance = std::chrono::microseconds(2);       ///< a pair no further off is never an outlier
  Duration reference_timeout = std::chrono::milliseconds(300);  ///< without a pair, then: hold-over
  Duration hold_over_limit = std::chrono::seconds(10);          ///< in hold-over this long still in sync
  bool operator==(const DistributedClockSettings&) const = default;
};

}  // namespace plchost
