#include "schedulers/watchdog_rules.hpp"

#include <algorithm>

namespace plchost {

std::optional<CycleLimit> cycle_limit(const TaskConfig& task, const WatchdogSettings& settings) noexcept {
  if (task.watchdog.time > Duration::zero()) {
    return CycleLimit{.limit = task.watchdog.time * task.watchdog.sensitivity, .lenient = false};
  }
  if (settings.default_time == Duration::zero()) return std::nullopt;
  // A task with a long interval may well compute as long as that.
  return CycleLimit{.limit = std::max(settings.default_time, task.interval), .lenient = true};
}

void LoadRule::begin(TimePoint now, const Sample& sample) {
  begun_ = now;
  process_ = sample.process;
  tasks_.assign(sample.tasks.begin(), sample.tasks.end());
}

std::optional<LoadRule::Hit> LoadRule::end(TimePoint now, const Sample& sample, int maximum, int cores) {
  const Duration window = now - begun_;
  Duration used = sample.process - process_;
  Duration most{};
  std::size_t culprit = 0;
  for (std::size_t i = 0; i < sample.tasks.size(); ++i) {
    const Duration own = sample.tasks[i] - tasks_[i];
    if (freewheeling_[i]) {
      used -= own;
    } else if (own > most) {
      most = own;
      culprit = i;
    }
  }
  begin(now, sample);
  if (window <= Duration::zero()) return std::nullopt;
  const Duration load = std::max(most, used / std::max(cores, 1));
  const auto percent = static_cast<int>(load * 100 / window);
  if (percent <= maximum) return std::nullopt;
  return Hit{.percent = percent, .task = culprit};
}

}  // namespace plchost
