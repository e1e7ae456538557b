// Start latency of a 1 ms cyclic task: planned release to the first instruction of the task's code. The floor
// is a bare SCHED_FIFO thread in clock_nanosleep(TIMER_ABSTIME), same priority, same core, in alternation.

#include <array>
#include <thread>

#include <time.h>

#include "schedulers/task_set.hpp"
#include "shm/base/task_statistics.hpp"
#include "tests/bench/bench.hpp"

namespace plchost::bench {

namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(1);

std::size_t samples_in(Duration slice) {
  return static_cast<std::size_t>(slice / kPeriod) * 2;
}

Result<void> run_floor(const Plan& plan, Samples& into) {
  Samples samples(samples_in(plan.slice));
  auto body = [&] {
    const TimePoint end = MonotonicClock::now() + plan.slice;
    TimePoint release = MonotonicClock::now() + kPeriod;
    while (release < end) {
      const timespec until = to_timespec(release);
      ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
      const TimePoint now = MonotonicClock::now();
      samples.add(now - release);
      // Like ours: what passed is skipped, never replayed.
      do release += kPeriod;
      while (release <= now);
    }
  };
  auto thread = Thread::start("floor", kPriority, body);
  if (!thread) return std::unexpected(thread.error());
  thread->join();
  into.append(samples);
  return {};
}

Result<void> run_scheduler(const Plan& plan, std::string_view name, Samples& into) {
  LinuxClock clock;
  TaskStatistics statistics;
  Samples samples(samples_in(plan.slice));
  TimePoint began{};
  TaskConfig task;
  task.name = "measured";
  task.interval = kPeriod;
  task.entry = [&] { began = MonotonicClock::now(); };
  task.after_cycle = [&](const TaskCounters& counters) {
    samples.add(began - TimePoint(Duration(counters.release_ns)));
  };
  TaskEnvironment environment;
  environment.statistics = [&](std::size_t) -> TaskStatistics& { return statistics; };
  auto tasks = TaskSet::create(clock, PriorityBand::normal, {task}, environment);
  if (!tasks) return std::unexpected(tasks.error());
  if (auto started = (*tasks)->start(name, {}); !started) return started;
  std::this_thread::sleep_for(plan.slice);
  if (auto stopped = (*tasks)->stop(std::chrono::seconds(5)); !stopped) return stopped;
  into.append(samples);
  return {};
}

}  // namespace

Result<std::vector<Row>> measure_cyclic(const Plan& plan) {
  // The process's other thread sleeps meanwhile; the measured ones inherit this core.
  if (auto bound = bind_thread(plan.task_core); !bound) return std::unexpected(bound.error());
  std::vector<Row> rows;
  for (const auto& entry : all_schedulers())
    rows.push_back({.name = "cyclic/" + std::string(entry.name) + "/1ms"});
  plan.progress("cyclic tasks, 1 ms, beside clock_nanosleep");
  for (int slice = 0; slice < plan.slices; ++slice) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (auto done = run_floor(plan, rows[i].floor); !done) return std::unexpected(done.error());
      if (auto done = run_scheduler(plan, all_schedulers()[i].name, rows[i].ours); !done) {
        return std::unexpected(done.error());
      }
    }
  }
  return rows;
}

}  // namespace plchost::bench
