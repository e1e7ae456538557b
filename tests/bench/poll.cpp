// The cost of polling the variables of 500 event tasks at each tick of CmpSchedule: the CPU time of its
// thread. The floor is a bare thread that sleeps on two timers in turn, as the tick does, and reads the same
// 500 variables each ms; a third one reads none.

#include <atomic>

#include <fmt/format.h>

#include "tests/bench/cyclic_loop.hpp"
#include "tests/bench/many_tasks.hpp"
#include "tests/bench/parts.hpp"

namespace plchost::bench {

namespace {

constexpr std::size_t kPolledTasks = 500;
constexpr Duration kPollSlice = std::chrono::seconds(1);

using Variables = std::vector<std::function<bool()>>;

Result<void> run_ours(const Plan& plan, const Variables& variables, Duration slice, Samples& into) {
  std::vector<TaskConfig> configs;
  for (std::size_t i = 0; i < variables.size(); ++i) {
    TaskConfig task;
    task.name = fmt::format("event{}", i);
    task.kind = TaskKind::event;
    task.event_variable = variables[i];
    task.entry = [] {};
    configs.push_back(std::move(task));
  }
  PLCHOST_TRY_ASSIGN(const auto cpu, measure_tick(plan, std::move(configs), slice));
  into.push(cpu);
  return {};
}

}  // namespace

Result<std::vector<Row>> measure_poll(const Plan& plan) {
  std::vector<std::atomic<bool>> values(kPolledTasks);
  Variables variables;
  for (const auto& value : values) variables.emplace_back([&value] { return value.load(); });
  std::atomic<bool> any{false};
  BareLoop reading(Wait::two_timers, kCyclePeriod, [&] {
    for (const auto& variable : variables) {
      if (variable()) any.store(true);
    }
  });
  BareLoop empty(Wait::two_timers, kCyclePeriod, [] {});
  CyclicFigures floor;
  CyclicFigures nothing;
  Samples ours;
  auto done =
      alternate(plan,
                {slices_of(plan, reading, kCyclePeriod, floor), slices_of(plan, empty, kCyclePeriod, nothing),
                 [&](Duration slice) { return run_ours(plan, variables, slice, ours); }},
                kPollSlice);
  if (!done) return std::unexpected(std::move(done.error()));
  const double loop = summarise(nothing.cpu_per_cycle).p50;
  const double poll = summarise(ours).p50 - loop;
  const double read = summarise(floor.cpu_per_cycle).p50 - loop;
  Row row{.name = "poll/CmpSchedule/500events",
          .sample = "a slice's mean of a tick",
          .ours = ours,
          .floor = floor.cpu_per_cycle};
  row.extra = {{"empty_loop_us", loop},
               {"poll_us", poll},
               {"floor_poll_us", read},
               {"poll_ns_per_task", 1e3 * poll / kPolledTasks},
               {"floor_poll_ns_per_task", 1e3 * read / kPolledTasks}};
  row.note =
      "CPU time per tick of 1 ms, a sample is a slice; poll_us is less that of a loop that polls nothing";
  return std::vector{row};
}

}  // namespace plchost::bench
