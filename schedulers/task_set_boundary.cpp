// A moment between the cycles of all tasks of a set.
#include "schedulers/task_set.hpp"
#include "schedulers/tasks/priorities.hpp"

namespace plchost {

std::optional<Duration> TaskSet::between_cycles(const std::function<void()>& action) {
  // Before anybody has to wait for it.
  if (!tasks_in_cycle().empty()) return std::nullopt;
  // Nothing but the tasks, which then wait at the gate, may make the moment longer.
  const RaisedPriority raised(environment_.allow_unprivileged ? ThreadPriority{} : switch_priority(band_));
  const TimePoint closed = MonotonicClock::now();
  gate_.close();
  const bool alone = tasks_in_cycle().empty();
  if (alone) action();
  gate_.open(clock_);
  if (!alone) return std::nullopt;
  return MonotonicClock::now() - closed;
}

std::vector<std::string_view> TaskSet::tasks_in_cycle() const {
  std::vector<std::string_view> names;
  for (const auto& task : tasks_) {
    if (task->in_cycle()) names.emplace_back(task->config().name);
  }
  if (names.empty() && poller_.trap().seat().taken()) names.emplace_back("event variables");
  return names;
}

}  // namespace plchost
