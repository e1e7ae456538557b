// 1,000 cyclic tasks of mixed periods in one instance, the faster ones above the slower ones, all beginning
// at one instant. Their lost cycles stand beside those of 1,000 bare threads that do the same with
// clock_nanosleep. And the CPU time per activation with 10, 100 and 1,000 tasks.

#include <array>
#include <atomic>
#include <thread>

#include <fmt/format.h>

#include "schedulers/policies/registry.hpp"
#include "tests/bench/many_tasks.hpp"
#include "tests/bench/parts.hpp"
#include "tests/bench/thread_usage.hpp"

namespace plchost::bench {

namespace {

constexpr Duration kScaleWork = std::chrono::microseconds(15);
constexpr std::array kTaskCounts = {std::size_t{10}, std::size_t{100}, std::size_t{1000}};

/// Of each 20 tasks 1, 2, 5 and 12 have these periods: 21,000 activations per second of 1,000 tasks.
struct Period {
  std::size_t of_twenty;
  std::chrono::milliseconds interval;
  int iec_priority;
};
constexpr std::array kPeriods = {
    Period{1, std::chrono::milliseconds(10), 0}, Period{2, std::chrono::milliseconds(20), 1},
    Period{5, std::chrono::milliseconds(50), 2}, Period{12, std::chrono::milliseconds(100), 3}};

const Period& period_of(std::size_t task) {
  std::size_t place = task % 20;
  for (const Period& period : kPeriods) {
    if (place < period.of_twenty) return period;
    place -= period.of_twenty;
  }
  return kPeriods.back();
}

struct ScaleFigures {
  std::uint64_t cycles = 0;
  std::uint64_t lost = 0;
  Duration cpu{};
  Duration measured{};
  Samples cpu_per_activation;  // one per slice; less what the task itself works

  [[nodiscard]] double load() const { return ratio(to_us(cpu), to_us(measured)); }
};

/// Measures while something runs; `cycles` and `lost` say how much of it ran so far.
template <class Cycles, class Lost>
void measure_slice(const Plan& plan, Duration slice, ScaleFigures& into, Cycles cycles, Lost lost) {
  const OnCore out_of_the_way(plan.poster_core);
  std::this_thread::sleep_for(kWarmUp);
  const std::uint64_t cycles_before = cycles();
  const std::uint64_t lost_before = lost();
  const ThreadUsage usage_before = usage_of_other_threads();
  const TimePoint begin = MonotonicClock::now();
  std::this_thread::sleep_for(slice);
  const Duration cpu = (usage_of_other_threads() - usage_before).cpu;
  const std::uint64_t ran = cycles() - cycles_before;
  into.cycles += ran;
  into.lost += lost() - lost_before;
  into.cpu += cpu;
  into.measured += MonotonicClock::now() - begin;
  if (ran > 0) into.cpu_per_activation.push(cpu / static_cast<Duration::rep>(ran) - kScaleWork);
}

Result<void> run_ours(const Plan& plan, std::string_view scheduler, std::size_t size, Duration slice,
                      ScaleFigures& into) {
  std::vector<TaskConfig> configs;
  for (std::size_t i = 0; i < size; ++i) {
    TaskConfig task;
    task.name = fmt::format("task{}", i);
    task.interval = period_of(i).interval;
    task.iec_priority = period_of(i).iec_priority;
    task.entry = [] { work(kScaleWork); };
    configs.push_back(std::move(task));
  }
  PLCHOST_TRY_ASSIGN(const auto tasks, ManyTasks::start(plan, scheduler, std::move(configs)));
  measure_slice(plan, slice, into, [&] { return tasks->cycles(); }, [&] { return tasks->lost(); });
  return tasks->stop();
}

/// The bare threads' own counters.
struct Bare {
  TimePoint origin;
  std::atomic<bool> stopping{false};
  std::atomic<std::uint64_t> cycles{0};
  std::atomic<std::uint64_t> lost{0};

  void run(Duration interval) noexcept {
    for (TimePoint release = origin; !stopping.load(std::memory_order_relaxed);) {
      const timespec until = to_timespec(release);
      ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
      work(kScaleWork);
      cycles.fetch_add(1, std::memory_order_relaxed);
      const TimePoint end = MonotonicClock::now();
      for (release += interval; release < end; release += interval)
        lost.fetch_add(1, std::memory_order_relaxed);
    }
  }
};

Result<void> run_floor(const Plan& plan, std::size_t size, Duration slice, ScaleFigures& into) {
  Bare bare{.origin = MonotonicClock::now() + std::chrono::milliseconds(100)};
  std::vector<Thread> threads;
  Result<void> started;
  {
    const OnCore threads_inherit_it(plan.task_core);
    for (std::size_t i = 0; i < size && started; ++i) {
      const Period& period = period_of(i);
      auto thread = Thread::start("bare", task_priority(PriorityBand::normal, period.iec_priority),
                                  [&bare, &period] { bare.run(period.interval); });
      if (thread) {
        threads.push_back(std::move(*thread));
      } else {
        started = std::unexpected(std::move(thread.error()));
      }
    }
  }
  if (started) {
    measure_slice(plan, slice, into, [&] { return bare.cycles.load(); }, [&] { return bare.lost.load(); });
  }
  bare.stopping.store(true);
  threads.clear();
  return started;
}

/// All sizes of one scheduler, or of the floor.
using Sizes = std::array<ScaleFigures, kTaskCounts.size()>;

double per_million(const ScaleFigures& figures) {
  return 1e6 * ratio(static_cast<double>(figures.lost), static_cast<double>(figures.cycles + figures.lost));
}

Row to_row(std::string_view scheduler, const Sizes& ours, const Sizes& floor) {
  const auto cost = [](const ScaleFigures& figures) { return summarise(figures.cpu_per_activation).p50; };
  // A tick each ms and two changes of thread for each activation, or one timer and one change.
  const double most = scheduler == "CmpSchedule" ? 3 : 2;
  return {.name = fmt::format("scale/{}/1000tasks", scheduler),
          .sample = "a slice's mean of an activation",
          .ours = ours.back().cpu_per_activation,
          .floor = floor.back().cpu_per_activation,
          .extra = {{"load", ours.back().load()},
                    {"floor_load", floor.back().load()},
                    {"activations", static_cast<double>(ours.back().cycles)},
                    {"lost", static_cast<double>(ours.back().lost)},
                    {"floor_lost", static_cast<double>(floor.back().lost)},
                    {"cpu_us_per_activation_10", cost(ours[0])},
                    {"cpu_us_per_activation_100", cost(ours[1])},
                    {"cpu_us_per_activation_1000", cost(ours[2])},
                    {"floor_cpu_us_per_activation_10", cost(floor[0])},
                    {"floor_cpu_us_per_activation_100", cost(floor[1])},
                    {"floor_cpu_us_per_activation_1000", cost(floor[2])}},
          .targets = {{"load below 60 %", "share", ours.back().load(), 0.6},
                      lost_cycles_target("1,000 bare threads", per_million(ours.back()),
                                         per_million(floor.back())),
                      {fmt::format("CPU per activation at most {} times that of 1,000 bare threads", most),
                       "us", cost(ours[2]), most * cost(floor[2]), true}},
          .note = "CPU time per activation without the task's own 15 us; a sample is a slice"};
}

/// With so many tasks that are not due.
Result<void> measure_idle_tick(const Plan& plan, std::size_t size, Duration slice, Samples& into) {
  std::vector<TaskConfig> configs;
  for (std::size_t i = 0; i < size; ++i) {
    TaskConfig task;
    task.name = fmt::format("task{}", i);
    task.interval = std::chrono::hours(1);
    task.entry = [] {};
    configs.push_back(std::move(task));
  }
  PLCHOST_TRY_ASSIGN(const auto cpu, measure_tick(plan, std::move(configs), slice));
  into.push(cpu);
  return {};
}

Result<Row> measure_ticks(const Plan& plan) {
  Row row{.name = "scale/CmpSchedule/tick", .sample = "a slice's mean of a tick"};
  auto done = alternate(
      plan,
      {[&](Duration slice) { return measure_idle_tick(plan, kTaskCounts.front(), slice, row.floor); },
       [&](Duration slice) { return measure_idle_tick(plan, kTaskCounts.back(), slice, row.ours); }},
      std::chrono::seconds(1));
  if (!done) return std::unexpected(std::move(done.error()));
  row.targets = {{"a tick with 1,000 tasks that are not due at most 1.2 times one with 10", "us",
                  summarise(row.ours).p50, 1.2 * summarise(row.floor).p50, true}};
  row.note = "CPU time per tick with 1,000 tasks of which none is due; floor: with 10";
  return row;
}

}  // namespace

Result<std::vector<Row>> measure_scale(const Plan& plan) {
  std::vector<Sizes> figures(all_schedulers().size() + 1);
  for (std::size_t size = 0; size < kTaskCounts.size(); ++size) {
    Plan share = plan;
    if (kTaskCounts[size] != kTaskCounts.back()) share.each = plan.each / 4;
    std::vector<Subject> subjects{[&, size](Duration slice) {
      return run_floor(plan, kTaskCounts[size], slice, figures.back()[size]);
    }};
    for (std::size_t i = 0; i < all_schedulers().size(); ++i) {
      subjects.emplace_back([&, size, i](Duration slice) {
        return run_ours(plan, all_schedulers()[i].name, kTaskCounts[size], slice, figures[i][size]);
      });
    }
    PLCHOST_TRY(alternate(share, subjects));
  }
  std::vector<Row> rows;
  for (std::size_t i = 0; i < all_schedulers().size(); ++i)
    rows.push_back(to_row(all_schedulers()[i].name, figures[i], figures.back()));
  Plan share = plan;
  share.each = plan.each / 4;
  PLCHOST_TRY_ASSIGN(auto ticks, measure_ticks(share));
  rows.push_back(std::move(ticks));
  return rows;
}

}  // namespace plchost::bench
