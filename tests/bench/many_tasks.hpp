#pragma once

#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "schedulers/task_set.hpp"
#include "tests/bench/bench.hpp"

namespace plchost::bench {

/// Burns the processor for that long, as the code of a task would.
void work(Duration time) noexcept;

/// Many tasks in one TaskSet, on the task core.
class ManyTasks {
 public:
  [[nodiscard]] static Result<std::unique_ptr<ManyTasks>> start(const Plan& plan, std::string_view scheduler,
                                                                std::vector<TaskConfig> tasks);
  [[nodiscard]] Result<void> stop() { return tasks_->stop(std::chrono::seconds(10)); }
  /// Of all tasks together so far.
  [[nodiscard]] std::uint64_t cycles() const { return sum(&TaskCounters::cycles); }
  [[nodiscard]] std::uint64_t lost() const { return sum(&TaskCounters::lost_cycles); }

 private:
  explicit ManyTasks(std::size_t count) : count_(count), statistics_(new TaskStatistics[count]()) {}
  [[nodiscard]] std::uint64_t sum(std::uint64_t TaskCounters::* member) const;

  LinuxClock clock_;
  std::size_t count_;
  std::unique_ptr<TaskStatistics[]> statistics_;  // NOLINT(modernize-avoid-c-arrays): cannot be moved
  std::unique_ptr<TaskSet> tasks_;
};

/// The CPU time of one 1 ms tick of CmpSchedule with these tasks, on average over `slice`.
[[nodiscard]] Result<Duration> measure_tick(const Plan& plan, std::vector<TaskConfig> tasks, Duration slice);

}  // namespace plchost::bench
