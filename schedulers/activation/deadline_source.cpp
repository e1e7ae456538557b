#include "schedulers/activation/deadline_source.hpp"

#include <algorithm>

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

}  // namespace plchost
