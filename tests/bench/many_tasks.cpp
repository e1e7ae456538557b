#include "tests/bench/many_tasks.hpp"

#include <thread>

#include "tests/bench/thread_usage.hpp"

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
  PLCHOST_TRY_ASSIGN(self->tasks_,
                     TaskSet::create(self->clock_, PriorityBand::normal, std::move(tasks), environment));
  PLCHOST_TRY(self->tasks_->start(scheduler, {}));
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

Result<Duration> measure_tick(const Plan& plan, std::vector<TaskConfig> tasks, Duration slice) {
  constexpr Duration kTick = std::chrono::milliseconds(1);
  PLCHOST_TRY_ASSIGN(const auto started, ManyTasks::start(plan, "CmpSchedule", std::move(tasks)));
  const OnCore out_of_the_way(plan.poster_core);
  std::this_thread::sleep_for(kWarmUp);
  const ThreadUsage before = usage_of_other_threads("tick");
  const TimePoint begin = MonotonicClock::now();
  std::this_thread::sleep_for(slice);
  const Duration cpu = (usage_of_other_threads("tick") - before).cpu;
  const auto ticks = (MonotonicClock::now() - begin) / kTick;
  PLCHOST_TRY(started->stop());
  return cpu / ticks;
}

}  // namespace plchost::bench
