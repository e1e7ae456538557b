// Each scheduler and the floor F at the same time on the same core, with the same priority, so that a stall
// of the host hits both. Their grids lie half a period apart. So neither is ready when the other is released,
// and they do not wait for each other; a stall, which is longer, is seen by both.

#include <algorithm>
#include <cmath>
#include <thread>

#include "schedulers/policies/registry.hpp"
#include "tests/bench/cyclic_loop.hpp"
#include "tests/bench/parts.hpp"

namespace plchost::bench {

namespace {

constexpr auto kCorunPatience = std::chrono::seconds(10);

struct CorunFigures {
  Samples ours;
  Samples floor;
  std::uint64_t lost_ours = 0;
  std::uint64_t lost_floor = 0;
  Stalls stalls;
};

/// Where the scheduler's grid lies is known from its first release.
Result<TimePoint> release_of(const ScheduledLoop& loop) {
  const TimePoint end = MonotonicClock::now() + kCorunPatience;
  while (loop.last_release() == TimePoint{}) {
    if (MonotonicClock::now() > end) return failure(ErrorCode::timed_out, "no cycle ran");
    std::this_thread::sleep_for(kCyclePeriod);
  }
  return loop.last_release();
}

Result<void> run_slice(const Plan& plan, ScheduledLoop& loop, Duration slice, CorunFigures& into) {
  const auto capacity = static_cast<std::size_t>((slice + 2 * kWarmUp) / kCyclePeriod) * 2;
  CycleLog our_log(capacity);
  CycleLog bare_log(capacity);
  BareLoop bare(Wait::sleep, kCyclePeriod);
  {
    const OnCore threads_inherit_it(plan.task_core);
    if (auto started = loop.start(our_log); !started) return started;
    PLCHOST_TRY_ASSIGN(const auto release, release_of(loop));
    bare.align(release + kCyclePeriod / 2);
    if (auto started = bare.start(bare_log); !started) return started;
  }
  const OnCore out_of_the_way(plan.poster_core);
  std::this_thread::sleep_for(kWarmUp);
  const TimePoint begin = MonotonicClock::now();
  std::this_thread::sleep_for(slice);
  const TimePoint end = MonotonicClock::now();
  auto stopped = loop.stop();
  (void)bare.stop();
  const auto ours = our_log.between(begin, end);
  const auto floor = bare_log.between(begin, end);
  add_latencies(ours, into.ours);
  add_latencies(floor, into.floor);
  into.lost_ours += lost_cycles(ours, kCyclePeriod);
  into.lost_floor += lost_cycles(floor, kCyclePeriod);
  into.stalls += find_stalls(ours, floor, kCyclePeriod);
  return stopped;
}

double per(std::uint64_t count, std::uint64_t stalls) {
  return ratio(static_cast<double>(count), static_cast<double>(stalls));
}

/// A count of what happens at random, and twice its standard deviation.
double with_deviation(double count) {
  return count + 2 * std::sqrt(count);
}

Row to_row(std::string_view scheduler, const CorunFigures& figures) {
  const Stalls& stalls = figures.stalls;
  const double p999 = decisive_p999(figures.ours);
  const double bare_p999 = decisive_p999(figures.floor);
  return {
      .name = "corun/" + std::string(scheduler) + "/1ms",
      .sample = "a cycle",
      .ours = figures.ours,
      .floor = figures.floor,
      .extra = {{"stalls", static_cast<double>(stalls.stalls)},
                {"late_per_stall", per(stalls.late_ours, stalls.stalls)},
                {"floor_late_per_stall", per(stalls.late_floor, stalls.stalls)},
                {"lost_per_stall", per(stalls.lost_ours, stalls.stalls)},
                {"floor_lost_per_stall", per(stalls.lost_floor, stalls.stalls)},
                {"lost", static_cast<double>(figures.lost_ours)},
                {"floor_lost", static_cast<double>(figures.lost_floor)}},
      .targets = {{"p99.9 below 1.1 F", "us", p999, 1.1 * bare_p999},
                  {"late cycles per stall below 1.2", "cycles", per(stalls.late_ours, stalls.stalls), 1.2},
                  {"lost cycles in stalls at most 1.2 F's, and two standard deviations", "cycles",
                   stalls.stalls > 0 ? static_cast<double>(stalls.lost_ours) : kNotMeasured,
                   with_deviation(1.2 * static_cast<double>(stalls.lost_floor)), true}},
      .note = "a stall is seen by both; a cycle is late if it starts a whole period late"};
}

}  // namespace

Result<std::vector<Row>> measure_corun(const Plan& plan) {
  std::vector<std::unique_ptr<ScheduledLoop>> loops;
  std::vector<CorunFigures> figures(all_schedulers().size());
  std::vector<Subject> subjects;
  for (const auto& entry : all_schedulers()) {
    loops.push_back(std::make_unique<ScheduledLoop>(entry.name, kCyclePeriod));
    subjects.push_back([&plan, &loop = *loops.back(), &into = figures[loops.size() - 1]](Duration slice) {
      return run_slice(plan, loop, slice, into);
    });
  }
  PLCHOST_TRY(alternate(plan, subjects));
  std::vector<Row> rows;
  for (std::size_t i = 0; i < figures.size(); ++i)
    rows.push_back(to_row(all_schedulers()[i].name, figures[i]));
  return rows;
}

}  // namespace plchost::bench
