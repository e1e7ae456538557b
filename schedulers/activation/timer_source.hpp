#pragma once

#include <memory>

#include "schedulers/tasks/task.hpp"

namespace plchost {

/// A cyclic task sleeps in the read of periodic timers of the kernel of its own. They say when to
/// look, and by themselves how often they went off; which release it is, and which were lost, follows from
/// the task's grid alone.
class TimerSource final : public ActivationSource {
 public:
  TimerSource(Clock& clock, const Task& task, FreewheelRule rule,
              std::unique_ptr<PeriodicTimer> timer) noexcept;

  [[nodiscard]] std::optional<Activation> wait() noexcept override;
  void interrupt() noexcept override { timer_->interrupt(); }

 private:
  void arm_for(TimePoint release) noexcept;

  Clock& clock_;
  const Task& task_;
  FreewheelRule rule_;
  std::unique_ptr<PeriodicTimer> timer_;
  TimePoint next_;     // goes off then, by its own count
  Duration period_{};  // 0: not armed
};

}  // namespace plchost
