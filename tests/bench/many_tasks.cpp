#include "tests/bench/many_tasks.hpp"

namespace plchost::bench {

void work(Duration time) noexcept {
  const TimePoint end = MonotonicClock::now() + time;
  while (MonotonicClock::now() < end) {
  }
}

Result<std::unique_ptr<ManyTasks>> ManyTasks::start(const Plan& plan, std::string_view scheduler,
                                                    std::vector<TaskConfig> tasks) {
  std::unique_ptr<ManyTasks> self(new ManyTasks(tasks.size()));
  TaskEnvironment environment;
  environment.statistics = [raw = self.get()](std::size_t i) -> TaskStatistics& {
    return raw->statistics_[i];
  };
  const OnCore threads_inherit_it(plan.task_core);
  auto made = TaskSet::create(self->clock_, PriorityBand::normal, std::move(tasks), environment);
  if (!made) return std::unexpected(std::move(made.error()));
  self->tasks_ = std::move(*made);
  if (auto started = self->tasks_->start(scheduler, {}); !started)
    return std::unexpected(std::move(started.error()));
  return self;
}

std::uint64_t ManyTasks::sum(std::uint64_t TaskCounters::* member) const {
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    auto counters = statistics_[i].counters.read();
    while (!counters) counters = statistics_[i].counters.read();
    total += (*counters).*member;
  }
  return total;
}

}  // namespace plchost::bench
