#include "api/client/host_clock.hpp"

#include <algorithm>

namespace plchost {

void HostClock::take(const plc_Presence& presence, TimePoint now) noexcept {
  const std::int64_t ahead = presence.clock_ns - now.time_since_epoch().count();
  const bool counts = presence.epoch != epoch_ || now - measured_ > kWindow || ahead >= ahead_ns_;
  if (!counts) return;
  epoch_ = presence.epoch;
  ahead_ns_ = ahead;
  measured_ = now;
}

plc_TimeLimit HostClock::limit_at(TimePoint deadline) const noexcept {
  // A deadline that never comes stays one.
  constexpr Duration kMost = std::chrono::hours(24 * 365);
  const TimePoint limit = std::min(deadline, measured_ + kMost) - kMargin;
  return {.epoch = epoch_, .clock_ns = limit.time_since_epoch().count() + ahead_ns_};
}

}  // namespace plchost
