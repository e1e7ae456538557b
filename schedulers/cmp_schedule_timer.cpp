#include "schedulers/cmp_schedule_timer.hpp"

#include <utility>

namespace plchost {

namespace {

class TimerSource final : public ActivationSource {
 public:
  TimerSource(Clock& clock, const Task& task, FreewheelRule rule,
              std::unique_ptr<PeriodicTimer> timer) noexcept
      : clock_(clock), task_(task), rule_(rule), timer_(std::move(timer)) {}

  // The timer says when to look; which release it is, and which were lost, follows from the grid alone.
  std::optional<Activation> wait() noexcept override {
    const Activation activation = task_.next_release(rule_);
    // Anew when the task's interval was changed at run time.
    if (armed_ != task_.interval_in_force()) {
      armed_ = task_.interval_in_force();
      timer_->start(activation.release, armed_);
    }
    // A release that is over already is not waited for: the timer may have told of it together with the one
    // before.
    while (clock_.now() < activation.release) {
      if (timer_->wait() == 0) {
        armed_ = Duration::zero();
        return std::nullopt;
      }
    }
    return activation;
  }

  void interrupt() noexcept override { timer_->interrupt(); }

 private:
  Clock& clock_;
  const Task& task_;
  FreewheelRule rule_;
  std::unique_ptr<PeriodicTimer> timer_;
  Duration armed_{};  // its period; 0: not armed
};

}  // namespace

Result<std::unique_ptr<ActivationSource>> CmpScheduleTimer::cyclic_source(const Task& task) {
  auto timer = clock().make_periodic_timer();
  if (!timer) return std::unexpected(std::move(timer.error()));
  return std::make_unique<TimerSource>(clock(), task, FreewheelRule(settings()), std::move(*timer));
}

std::unique_ptr<Scheduler> make_cmp_schedule_timer(const SchedulerContext& context) {
  return std::make_unique<CmpScheduleTimer>(context);
}

}  // namespace plchost
