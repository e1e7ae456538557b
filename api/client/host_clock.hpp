#pragma once

#include <cstdint>

#include <control.h>

#include "shm/base/time.hpp"

namespace plchost {

/// How far the clock of a host is ahead of the one here, as its presence tells: at least so far. A presence
/// is older when it is taken than when it was written, never younger. So a time of this process, told by the
/// host's clock, is never later there than here; neither CLOCK_REALTIME counts.
class HostClock {
 public:
  /// A limit is by so much earlier than what it stands for: more than two clocks drift apart meanwhile.
  static constexpr Duration kMargin = std::chrono::milliseconds(1);
  /// The best of the presences of so long counts.
  static constexpr Duration kWindow = std::chrono::seconds(1);

  void take(const plc_Presence& presence, TimePoint now) noexcept;
  /// 0: the host has not been seen yet, and has no limit.
  [[nodiscard]] std::uint64_t epoch() const noexcept { return epoch_; }
  /// For what nobody here waits for after `deadline`. Only of a host that was seen.
  [[nodiscard]] plc_TimeLimit limit_at(TimePoint deadline) const noexcept;

 private:
  std::uint64_t epoch_ = 0;
  std::int64_t ahead_ns_ = 0;
  TimePoint measured_;
};

}  // namespace plchost
