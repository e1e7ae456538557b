#pragma once

#include <memory>

#include "schedulers/activation/spin_guard.hpp"
#include "schedulers/tasks/activation_gate.hpp"
#include "schedulers/tasks/task.hpp"

namespace plchost {

/// Sleeps until an absolute deadline that is computed anew each cycle; wakes ahead of it by a guard and spins
/// the rest.
class DeadlineSource final : public ActivationSource {
 public:
  /// `spin_ahead_max` 0: sleeps only.
  DeadlineSource(Clock& clock, const Task& task, FreewheelRule rule, Duration spin_ahead_max) noexcept
      : clock_(clock), task_(task), rule_(rule), guard_(spin_ahead_max) {}

  [[nodiscard]] std::optional<Activation> wait() noexcept override;
  void interrupt() noexcept override { gate_.interrupt(clock_); }

 private:
  Clock& clock_;
  const Task& task_;
  FreewheelRule rule_;
  SpinGuard guard_;
  ActivationGate gate_;
};

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
