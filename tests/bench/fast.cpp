// CmpScheduleOneShot at 250 us and 100 us: does it hold the grid? The floor is a thread that spins on the
// clock from release to release, same priority, same core, in alternation; F at the same period stands beside
// them.

#include <fmt/format.h>

#include "tests/bench/cyclic_loop.hpp"
#include "tests/bench/parts.hpp"

namespace plchost::bench {

namespace {

/// The kernel takes the core from a spinning thread of real time for the others after 0.95 s: shorter slices
/// keep most of that out of the floor.
constexpr Duration kSpinSlice = std::chrono::milliseconds(500);

Result<Row> measure_period(const Plan& plan, Duration period) {
  ScheduledLoop scheduled("CmpScheduleOneShot", period);
  BareLoop spinning(Wait::spin, period);
  BareLoop sleeping(Wait::sleep, period);
  CyclicFigures ours;
  CyclicFigures spun;
  CyclicFigures slept;
  auto done = alternate(plan,
                        {slices_of(plan, scheduled, period, ours), slices_of(plan, spinning, period, spun),
                         slices_of(plan, sleeping, period, slept)},
                        kSpinSlice);
  if (!done) return std::unexpected(std::move(done.error()));
  const Summary plain = summarise(slept.latencies);
  return Row{
      .name = fmt::format("fast/CmpScheduleOneShot/{}us", period / std::chrono::microseconds(1)),
      .sample = "a cycle",
      .ours = ours.latencies,
      .floor = spun.latencies,
      .extra = {{"lost", static_cast<double>(ours.lost)},
                {"floor_lost", static_cast<double>(spun.lost)},
                {"sleep_lost", static_cast<double>(slept.lost)},
                {"lost_per_million", ours.lost_per_million()},
                {"floor_lost_per_million", spun.lost_per_million()},
                {"sleep_lost_per_million", slept.lost_per_million()},
                {"spin_share_of_core", ours.spin_share()},
                {"cpu_share_of_core", ratio(to_us(ours.usage.cpu), to_us(ours.measured))},
                {"sleep_p50_us", plain.p50},
                {"sleep_p99_us", plain.p99}},
      .targets = {lost_cycles_target("F at the same period", ours.lost_per_million(),
                                     slept.lost_per_million())},
      .note =
          "floor: a bare loop that only spins, from which the kernel takes up to 5 % of the core if others "
          "wait; sleep_*: F at the same period"};
}

}  // namespace

Result<std::vector<Row>> measure_fast(const Plan& plan) {
  std::vector<Row> rows;
  for (const Duration period : {std::chrono::microseconds(250), std::chrono::microseconds(100)}) {
    PLCHOST_TRY_ASSIGN(auto row, measure_period(plan, period));
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace plchost::bench
