#pragma once

#include <optional>
#include <utility>

#include "schedulers/clock/clock.hpp"
#include "schedulers/tasks/activation.hpp"
#include "schedulers/tasks/freewheel_rule.hpp"
#include "schedulers/tasks/task_config.hpp"

namespace plchost {

/// In the place of the real task, for the model of the tick table: the functions that the table calls. Its
/// releases lie an interval apart; one follows when ran() says that the one before has run.
class Task {
 public:
  Task(int priority, Duration interval) noexcept : interval_(interval), release_(interval) {
    config_.iec_priority = priority;
  }
  [[nodiscard]] const TaskConfig& config() const noexcept { return config_; }
  [[nodiscard]] Activation next_release(const FreewheelRule& /*rule*/) const noexcept {
    return {.release = TimePoint(release_)};
  }
  [[nodiscard]] Duration interval() const noexcept { return interval_; }
  void ran() noexcept { release_ += interval_; }

 private:
  TaskConfig config_;
  Duration interval_;
  Duration release_;
};

}  // namespace plchost
