#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tests/bench/samples.hpp"

namespace plchost::bench {

/// One cycle as it ran.
struct Cycle {
  TimePoint release;  ///< planned
  TimePoint start;    ///< first instruction of the task's code
};

/// The cycles of one slice. add() never allocates.
class CycleLog {
 public:
  explicit CycleLog(std::size_t capacity) { cycles_.reserve(capacity); }
  void add(Cycle cycle) noexcept {
    if (cycles_.size() < cycles_.capacity()) cycles_.push_back(cycle);
  }
  /// Those released from `begin` on and before `end`. Once the writer has ended.
  [[nodiscard]] std::span<const Cycle> between(TimePoint begin, TimePoint end) const noexcept;

 private:
  std::vector<Cycle> cycles_;
};

void add_latencies(std::span<const Cycle> cycles, Samples& into);

/// Releases of the grid that no cycle ran for.
[[nodiscard]] std::uint64_t lost_cycles(std::span<const Cycle> cycles, Duration period) noexcept;

/// Stalls of the host. They are stretches of time in which each of two loops on one core, out of step by half
/// a period, started a cycle a whole period late or later. A gap that only one of them saw is not the host's.
struct Stalls {
  std::uint64_t stalls = 0;
  std::uint64_t late_ours =
      0;  ///< cycles started a period late or more: 1 per stall, more if they are replayed
  std::uint64_t late_floor = 0;
  std::uint64_t lost_ours = 0;  ///< releases skipped
  std::uint64_t lost_floor = 0;

  Stalls& operator+=(const Stalls& other) noexcept;
};

[[nodiscard]] Stalls find_stalls(std::span<const Cycle> ours, std::span<const Cycle> floor, Duration period);

}  // namespace plchost::bench
