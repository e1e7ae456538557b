#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "schedulers/distributed_clock/clock_model.hpp"
#include "schedulers/settings/scheduler_settings.hpp"

namespace plchost {

/// How far `release` lies behind the nearest point of the reference grid: where the reference time modulo
/// `interval` (> 0) is `offset`. At most half of an interval either way; negative: ahead of it. Pure.
[[nodiscard]] inline Duration deviation_from_grid(const ClockModel& model, TimePoint release,
                                                  Duration interval, Duration offset) noexcept {
  const std::int64_t since = wrapping_difference(model.reference_at(release), offset.count());
  Duration phase(since % interval.count());
  if (phase < Duration::zero()) phase += interval;
  return phase > interval / 2 ? phase - interval : phase;
}

/// The most that one release may be moved.
[[nodiscard]] inline Duration correction_bound(const DistributedClockSettings& settings,
                                               Duration interval) noexcept {
  constexpr int kDefaultShare = 100;
  if (settings.max_correction > Duration::zero()) return settings.max_correction;
  return std::max(interval / kDefaultShare, Duration(1));
}

/// In sync or not, with hysteresis: it takes kReleases in a row within half of the window to come in, and one
/// outside of the window to fall out. Pure.
class SyncWatch {
 public:
  static constexpr int kReleases = 16;

  explicit SyncWatch(Duration window) noexcept : window_(window) {}

  bool record(Duration deviation) noexcept {
    const Duration magnitude = deviation < Duration::zero() ? -deviation : deviation;
    if (magnitude > window_) in_sync_ = false;
    within_ = magnitude <= window_ / 2 ? std::min(within_ + 1, kReleases) : 0;
    if (within_ == kReleases) in_sync_ = true;
    return in_sync_;
  }

 private:
  Duration window_;
  int within_ = 0;
  bool in_sync_ = false;
};

}  // namespace plchost
