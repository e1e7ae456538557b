#include "schedulers/activation/self_timed_sources.hpp"

#include <algorithm>
#include <utility>

namespace plchost {

std::optional<Activation> DeadlineSource::wait() noexcept {
  Activation activation = task_.next_release(rule_);
  // Half of the period at least stays to others, also when it is made shorter at run time.
  const TimePoint wake_at = activation.release - std::min(guard_.value(), task_.interval_in_force() / 2);
  const bool sleeps = clock_.now() < wake_at;
  if (gate_.wait(clock_, wake_at) == ActivationGate::Outcome::interrupted) return std::nullopt;
  const TimePoint woken = clock_.now();
  if (sleeps) guard_.record(woken - wake_at);
  if (woken < activation.release) {
    clock_.spin_until(activation.release);
    activation.spun = activation.release - woken;
  }
  return activation;
}

TimerSource::TimerSource(Clock& clock, const Task& task, FreewheelRule rule,
                         std::unique_ptr<PeriodicTimer> timer) noexcept
    : clock_(clock), task_(task), rule_(rule), timer_(std::move(timer)) {}

// A release that is over already is not waited for: the timer may have told of it together with the one
// before.
std::optional<Activation> TimerSource::wait() noexcept {
  Activation activation = task_.next_release(rule_);
  arm_for(activation.release);
  while (clock_.now() < activation.release) {
    const std::uint64_t expirations = timer_->wait();
    if (expirations == 0) {
      period_ = Duration::zero();
      return std::nullopt;
    }
    activation.timer_expirations += expirations;
    next_ += static_cast<Duration::rep>(expirations) * period_;
  }
  return activation;
}

// Anew if the release is no point of the timer's: the interval was changed at run time, or the grid was
// moved.
void TimerSource::arm_for(TimePoint release) noexcept {
  const Duration interval = task_.interval_in_force();
  if (interval == period_ && (release == next_ || (release - next_) % period_ == Duration::zero())) return;
  period_ = interval;
  next_ = release;
  timer_->start(release, interval);
}

}  // namespace plchost
