#include "tests/bench/cycle_log.hpp"

#include <algorithm>

namespace plchost::bench {

namespace {

/// One late cycle.
struct Late {
  TimePoint release;
  TimePoint start;
  std::uint64_t lost = 0;  // releases skipped after it
  bool is_ours = false;
};

std::uint64_t skipped(const Cycle& before, const Cycle& after, Duration period) noexcept {
  const auto periods = (after.release - before.release + period / 2) / period;
  return periods > 1 ? static_cast<std::uint64_t>(periods - 1) : 0;
}

void add_late(std::span<const Cycle> cycles, Duration period, bool is_ours, std::vector<Late>& into) {
  for (std::size_t i = 0; i + 1 < cycles.size(); ++i) {
    if (cycles[i].start - cycles[i].release < period) continue;
    into.push_back({cycles[i].release, cycles[i].start, skipped(cycles[i], cycles[i + 1], period), is_ours});
  }
}

}  // namespace

std::span<const Cycle> CycleLog::between(TimePoint begin, TimePoint end) const noexcept {
  const auto first = std::ranges::lower_bound(cycles_, begin, {}, &Cycle::release);
  const auto last = std::ranges::lower_bound(cycles_, end, {}, &Cycle::release);
  return {first, last};
}

void add_latencies(std::span<const Cycle> cycles, Samples& into) {
  for (const Cycle& cycle : cycles) into.push(cycle.start - cycle.release);
}

std::uint64_t lost_cycles(std::span<const Cycle> cycles, Duration period) noexcept {
  std::uint64_t lost = 0;
  for (std::size_t i = 1; i < cycles.size(); ++i) lost += skipped(cycles[i - 1], cycles[i], period);
  return lost;
}

Stalls& Stalls::operator+=(const Stalls& other) noexcept {
  stalls += other.stalls;
  late_ours += other.late_ours;
  late_floor += other.late_floor;
  lost_ours += other.lost_ours;
  lost_floor += other.lost_floor;
  return *this;
}

Stalls find_stalls(std::span<const Cycle> ours, std::span<const Cycle> floor, Duration period) {
  std::vector<Late> late;
  add_late(ours, period, true, late);
  add_late(floor, period, false, late);
  std::ranges::sort(late, {}, &Late::release);
  Stalls sum;
  for (std::size_t i = 0; i < late.size();) {
    Stalls one{.stalls = 1};
    TimePoint until = late[i].start;
    for (; i < late.size() && late[i].release <= until; ++i) {
      until = std::max(until, late[i].start);
      (late[i].is_ours ? one.late_ours : one.late_floor) += 1;
      (late[i].is_ours ? one.lost_ours : one.lost_floor) += late[i].lost;
    }
    if (one.late_ours > 0 && one.late_floor > 0) sum += one;
  }
  return sum;
}

}  // namespace plchost::bench
