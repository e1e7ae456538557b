#pragma once

#include <cstdint>

#include "schedulers/settings/task_options.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The releases of a cyclic task: planned from the release before, never from "now". Pure.
class ReleaseGrid {
 public:
  struct Plan {
    TimePoint release;          ///< the release to run next; in the past if it is already due
    std::uint64_t lost_cycles;  ///< releases before it that will never run
  };

  /// The first release is at `origin`. `interval` > 0.
  ReleaseGrid(TimePoint origin, Duration interval, LatePolicy late) noexcept
      : next_(origin), interval_(interval), late_(late) {}

  /// The next run of a task that has been ready for it since `ready`. A release that came while it was ready
  /// runs, however late the wake-up is. Of those that came before, `next` loses all and `asap` all but the
  /// last.
  [[nodiscard]] Plan plan(TimePoint ready) const noexcept {
    if (ready <= next_) return {next_, 0};
    const Duration behind = ready - next_;
    const auto lost =
        late_ == LatePolicy::asap ? behind / interval_ : (behind + interval_ - Duration(1)) / interval_;
    return {next_ + lost * interval_, static_cast<std::uint64_t>(lost)};
  }

  /// The grid goes on in steps of `interval` (> 0) behind the release that is planned now, which stays.
  void set_interval(Duration interval) noexcept { interval_ = interval; }
  [[nodiscard]] Duration interval() const noexcept { return interval_; }

  /// The release that is planned now, and where it is moved to, with all that follow.
  [[nodiscard]] TimePoint next() const noexcept { return next_; }
  void shift(Duration by) noexcept { next_ += by; }

  /// The releases before `until` are skipped; how many they are.
  std::uint64_t pass_over(TimePoint until) noexcept {
    if (until <= next_) return 0;
    const auto passed = (until - next_ + interval_ - Duration(1)) / interval_;
    next_ += passed * interval_;
    return static_cast<std::uint64_t>(passed);
  }

  /// `release`, which plan() gave, runs.
  void ran(TimePoint release) noexcept { next_ = release + interval_; }

 private:
  TimePoint next_;  // neither run nor lost
  Duration interval_;
  LatePolicy late_;
};

}  // namespace plchost
