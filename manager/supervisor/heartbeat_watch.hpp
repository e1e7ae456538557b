#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "shm/base/time.hpp"

namespace plchost {

/// For how long a process's control thread has given no sign of itself: any number that changes is one. A gap
/// between two looks counts for a little only: while the whole host or the manager stood still, nothing is
/// known of the process. A gap in which other programs kept it from its core does not count. Pure.
class HeartbeatWatch {
 public:
  /// Longer than the guard against endless loops takes by default: until it hits, a loop above the control
  /// thread keeps that from beating.
  static constexpr Duration kLimit = std::chrono::seconds(3);
  static constexpr Duration kLongestGap = std::chrono::milliseconds(200);

  HeartbeatWatch() noexcept = default;
  explicit HeartbeatWatch(Duration limit) noexcept : limit_(limit) {}

  void look(TimePoint now, std::int64_t beat, bool starved = false) noexcept {
    const Duration counts = starved ? Duration::zero() : std::min(now - looked_, kLongestGap);
    silence_ = beat_ == beat ? silence_ + counts : Duration::zero();
    beat_ = beat;
    looked_ = now;
  }
  [[nodiscard]] bool silent() const noexcept { return silence_ >= limit_; }

 private:
  Duration limit_ = kLimit;
  std::optional<std::int64_t> beat_;
  TimePoint looked_;
  Duration silence_{};
};

}  // namespace plchost
