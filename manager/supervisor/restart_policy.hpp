#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "manager/config/manager_config.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Counts the failures of one process and says what follows from them. Time comes in from outside.
class RestartHistory {
 public:
  explicit RestartHistory(const InstanceConfig& config) noexcept : config_(config) {}

  /// A process ended by itself after it was up for `lasted` (zero: never came up).
  void record_end(TimePoint now, Duration lasted, bool crash);
  /// Goes on where another manager ended: how long ago each crash was, the oldest first, and the ends in a
  /// row.
  void restore(TimePoint now, const std::vector<Duration>& ages, std::uint32_t in_a_row);
  /// An operator has taken matters in hand.
  void forget() noexcept;

  /// restart_delay, doubled for each end in a row before the last, up to restart_delay_max.
  [[nodiscard]] Duration delay() const noexcept;
  /// Within the window, the oldest first.
  [[nodiscard]] const std::deque<TimePoint>& crashes() const noexcept { return crashes_; }
  [[nodiscard]] std::uint32_t in_a_row() const noexcept { return in_a_row_; }
  /// crash_limit crashes lie within crash_window.
  [[nodiscard]] bool too_many_crashes() const noexcept { return crashes_.size() >= config_.crash_limit; }

 private:
  const InstanceConfig& config_;
  std::deque<TimePoint> crashes_;  // within the window; at most crash_limit
  std::uint32_t in_a_row_ = 0;
};

}  // namespace plchost
