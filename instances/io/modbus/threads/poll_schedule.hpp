#pragma once

#include <algorithm>
#include <cstdint>

#include "shm/base/time.hpp"

namespace plchost::modbus {

/// When a device is polled. Polls lie on a grid of absolute times. A poll that takes longer than the interval
/// skips whole periods. After a failure the next poll comes after a pause that doubles up to a bound, on the
/// grid or, if that is shorter than the interval, beside it. Pure.
class PollSchedule {
 public:
  PollSchedule(Duration interval, Duration pause, Duration longest_pause, TimePoint first) noexcept
      : interval_(interval),
        first_pause_(pause),
        longest_pause_(longest_pause),
        pause_(pause),
        next_(first) {}

  [[nodiscard]] TimePoint next() const noexcept { return is_beside_grid_ ? retry_ : next_; }
  /// Of the polls that were due while another one was under way.
  [[nodiscard]] std::uint64_t skipped() const noexcept { return skipped_; }

  void answered(TimePoint now) noexcept {
    pause_ = first_pause_;
    is_beside_grid_ = false;
    skipped_ += step_beyond(now) - 1;
  }
  void failed(TimePoint now) noexcept {
    retry_ = now + pause_;
    (void)step_beyond(retry_);
    is_beside_grid_ = pause_ < interval_;
    if (is_beside_grid_) {
      next_ -= interval_;  // the time of the grid before it, from which the next one is counted
    }
    pause_ = std::min(pause_ * 2, longest_pause_);
  }

 private:
  // To the first time of the grid behind `least`.
  std::uint64_t step_beyond(TimePoint least) noexcept {
    const auto late = std::max(least - next_, Duration::zero());
    const auto periods = late / interval_ + 1;
    next_ += periods * interval_;
    return static_cast<std::uint64_t>(periods);
  }

  Duration interval_;
  Duration first_pause_;
  Duration longest_pause_;
  Duration pause_;
  TimePoint next_;
  TimePoint retry_;  ///< after the last failure
  bool is_beside_grid_ = false;
  std::uint64_t skipped_ = 0;
};

}  // namespace plchost::modbus
