#include "schedulers/deadline_source.hpp"

namespace plchost {

std::optional<Activation> DeadlineSource::wait() noexcept {
  Activation activation = task_.next_release(rule_);
  const TimePoint wake_at = activation.release - guard_.value();
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

}  // namespace plchost
