#pragma once

#include <cstdint>
#include <utility>

#include "schedulers/settings/task_options.hpp"

namespace plchost {

/// A task's look at its own cycles, when they end. Real-time.
class OverrunRule {
 public:
  enum class Verdict : std::uint8_t { fine, too_long, too_many_in_a_row };

  explicit OverrunRule(const TaskWatchdog& watchdog) noexcept
      : time_(watchdog.time),
        limit_(watchdog.time * watchdog.sensitivity),
        sensitivity_(watchdog.sensitivity) {}

  /// The next cycle is the first after a start or after an exchange of the scheduler: it may be slow, so it
  /// is not counted among those in a row.
  void forgive_next() noexcept {
    in_a_row_ = 0;
    forgiven_ = true;
  }

  [[nodiscard]] Verdict ended(Duration execution) noexcept {
    if (time_ == Duration::zero()) return Verdict::fine;
    const bool counts = !std::exchange(forgiven_, false);
    if (execution > limit_) return Verdict::too_long;
    if (execution <= time_ || !counts) {
      in_a_row_ = 0;
      return Verdict::fine;
    }
    return ++in_a_row_ >= sensitivity_ ? Verdict::too_many_in_a_row : Verdict::fine;
  }

  [[nodiscard]] std::uint32_t in_a_row() const noexcept { return in_a_row_; }
  [[nodiscard]] Duration time() const noexcept { return time_; }
  [[nodiscard]] Duration limit() const noexcept { return limit_; }

 private:
  Duration time_;
  Duration limit_;
  std::uint32_t sensitivity_;
  std::uint32_t in_a_row_ = 0;
  bool forgiven_ = true;
};

}  // namespace plchost
