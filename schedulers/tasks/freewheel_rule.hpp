#pragma once

#include <algorithm>

#include "schedulers/settings/scheduler_settings.hpp"

namespace plchost {

/// How long a freewheeling task leaves the processor to others after a cycle. Pure.
class FreewheelRule {
 public:
  static constexpr int kDefaultPercent = 20;
  /// A cycle of next to no time would otherwise never let go of the processor.
  static constexpr Duration kShortest = std::chrono::microseconds(10);

  explicit FreewheelRule(const SchedulerSettings& settings) noexcept
      : fixed_(settings.freewheeling_cycletime),
        percent_(settings.processor_load_maximum > 0 ? 100 - settings.processor_load_maximum
                                                     : kDefaultPercent) {}

  [[nodiscard]] Duration sleep_after(Duration execution) const noexcept {
    if (fixed_ > Duration::zero()) return fixed_;
    return std::max(execution * percent_ / 100, kShortest);
  }

 private:
  Duration fixed_;
  int percent_;
};

}  // namespace plchost
