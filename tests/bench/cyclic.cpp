// Start latency of a 1 ms cyclic task under each scheduler: planned release to the first instruction of the
// task's code, with its context switches and processor time. Beside it the floor F, a bare SCHED_FIFO thread
// in clock_nanosleep(TIMER_ABSTIME), same priority, same core, in alternation.

#include <array>

#include "schedulers/policies/registry.hpp"
#include "tests/bench/cyclic_loop.hpp"
#include "tests/bench/parts.hpp"

namespace plchost::bench {

namespace {

std::vector<Target> targets_for(std::string_view scheduler, const CyclicFigures& ours,
                                const CyclicFigures& floor) {
  const Summary our = summarise(ours.latencies);
  const Summary bare = summarise(floor.latencies);
  if (scheduler == "CmpScheduleOneShot") {
    return {{"median below 0.02 F", "us", our.p50, 0.02 * bare.p50},
            {"p99 below 0.5 F", "us", our.p99, 0.5 * bare.p99}};
  }
  if (scheduler == "CmpScheduleTimer") {
    return {{"median below F + 2 us", "us", our.p50, bare.p50 + 2},
            {"p99 below 1.15 F", "us", our.p99, 1.15 * bare.p99},
            {"1.0 context switches per cycle", "switches", ours.switches(), 1.05, true},
            {"CPU per cycle below 1.2 F's", "us", ours.cpu_us(), 1.2 * floor.cpu_us()}};
  }
  if (scheduler == "CmpSchedule") {
    return {{"median below F + 5 us", "us", our.p50, bare.p50 + 5},
            {"at most 2 context switches per cycle", "switches", ours.switches(), 2.05, true}};
  }
  return {};
}

/// The least that a scheduler's way of waiting costs.
void add_nearer_floor(const std::string& name, const CyclicFigures& figures, Row& row) {
  const Summary summary = summarise(figures.latencies);
  row.extra.emplace_back(name + "_p50_us", summary.p50);
  row.extra.emplace_back(name + "_p99_us", summary.p99);
  row.extra.emplace_back(name + "_cpu_us_per_cycle", figures.cpu_us());
}

}  // namespace

Result<std::vector<Row>> measure_cyclic(const Plan& plan) {
  BareLoop bare(Wait::sleep, kCyclePeriod);
  CyclicFigures floor;
  BareHop ticking(kCyclePeriod);
  CyclicFigures hop;
  BareLoop reading(Wait::timer, kCyclePeriod);
  CyclicFigures timer;
  std::vector<Subject> subjects{slices_of(plan, bare, kCyclePeriod, floor),
                                slices_of(plan, ticking, kCyclePeriod, hop),
                                slices_of(plan, reading, kCyclePeriod, timer)};
  std::vector<std::unique_ptr<ScheduledLoop>> loops;
  std::vector<CyclicFigures> figures(all_schedulers().size());
  for (const auto& entry : all_schedulers()) {
    loops.push_back(std::make_unique<ScheduledLoop>(entry.name, kCyclePeriod));
    subjects.push_back(slices_of(plan, *loops.back(), kCyclePeriod, figures[loops.size() - 1]));
  }
  PLCHOST_TRY(alternate(plan, subjects));
  std::vector<Row> rows;
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const std::string_view scheduler = all_schedulers()[i].name;
    rows.push_back({.name = "cyclic/" + std::string(scheduler) + "/1ms",
                    .sample = "a cycle",
                    .ours = figures[i].latencies,
                    .floor = floor.latencies,
                    .extra = {{"switches_per_cycle", figures[i].switches()},
                              {"floor_switches_per_cycle", floor.switches()},
                              {"cpu_us_per_cycle", figures[i].cpu_us()},
                              {"floor_cpu_us_per_cycle", floor.cpu_us()},
                              {"spin_share_of_core", figures[i].spin_share()},
                              {"lost_per_million", figures[i].lost_per_million()},
                              {"floor_lost_per_million", floor.lost_per_million()}},
                    .targets = targets_for(scheduler, figures[i], floor)});
    if (scheduler == "CmpSchedule") {
      add_nearer_floor("bare_tick", hop, rows.back());
      rows.back().note = "bare_tick_*: a bare thread that wakes another through a futex at each release";
    }
    if (scheduler == "CmpScheduleTimer") {
      add_nearer_floor("bare_timer", timer, rows.back());
      rows.back().note = "bare_timer_*: a bare thread that reads a periodic timerfd";
    }
  }
  return rows;
}

}  // namespace plchost::bench
