#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "shm/base/seqlock.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// A log-linear histogram of durations, 0 to about 17 s, one part in 32 wide (3 %). Written by one thread,
/// read by anyone, no lock. All zero is a valid empty one.
class DurationHistogram {
 public:
  static constexpr unsigned kSubBits = 5;
  static constexpr unsigned kMaxBits = 34;
  static constexpr std::size_t kBuckets = (kMaxBits - kSubBits + 1) << kSubBits;

  /// Real-time. Below zero counts as zero, beyond the range in the last bucket.
  void record(Duration value) noexcept {
    auto& bucket = buckets_[index_of(value)];
    bucket.store(bucket.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }

  [[nodiscard]] std::uint64_t total() const noexcept {
    std::uint64_t sum = 0;
    for (const auto& bucket : buckets_) sum += bucket.load(std::memory_order_relaxed);
    return sum;
  }

  /// The value that a share `fraction` (0 to 1) of all records is not above; the upper edge of its bucket.
  [[nodiscard]] Duration percentile(double fraction) const noexcept {
    const std::uint64_t all = total();
    if (all == 0) return Duration::zero();
    const double share = std::ceil(std::clamp(fraction, 0.0, 1.0) * static_cast<double>(all));
    const auto wanted = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(share));
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < kBuckets; ++i) {
      sum += buckets_[i].load(std::memory_order_relaxed);
      if (sum >= wanted) return upper_edge(i);
    }
    return upper_edge(kBuckets - 1);
  }

  [[nodiscard]] static std::size_t index_of(Duration value) noexcept {
    const auto clipped = static_cast<std::uint64_t>(std::max<Duration::rep>(value.count(), 0));
    const std::uint64_t ns = std::min(clipped, (std::uint64_t{1} << kMaxBits) - 1);
    const auto bits = static_cast<unsigned>(std::bit_width(ns));
    if (bits <= kSubBits) return ns;
    const unsigned shift = bits - kSubBits - 1;
    return ((std::size_t{shift} + 1) << kSubBits) + ((ns >> shift) & ((1U << kSubBits) - 1));
  }

  [[nodiscard]] static Duration upper_edge(std::size_t index) noexcept {
    const std::size_t octave = index >> kSubBits;
    const std::uint64_t sub = index & ((1U << kSubBits) - 1);
    if (octave == 0) return Duration(sub);
    const std::uint64_t base = (std::uint64_t{1} << kSubBits) + sub + 1;
    return Duration((base << (octave - 1)) - 1);
  }

 private:
  std::array<std::atomic<std::uint32_t>, kBuckets> buckets_{};
};

/// What is counted per task. Durations in nanoseconds. One writer: the task's own thread.
struct TaskCounters {
  std::uint64_t cycles;       ///< cycles that ran
  std::uint64_t lost_cycles;  ///< releases on the grid that passed without a cycle
  std::uint64_t lost_events;  ///< external events dropped because the backlog was beyond its bound
  std::int64_t exec_last_ns;  ///< start of the task's code to its end
  std::int64_t exec_sum_ns;
  std::int64_t exec_min_ns;
  std::int64_t exec_max_ns;
  std::int64_t latency_last_ns;  ///< start - planned release
  std::int64_t latency_max_ns;
  std::int64_t jitter_last_ns;  ///< signed: (start - start before) - planned distance; cyclic tasks only
  std::int64_t jitter_max_ns;   ///< largest magnitude of the same
  std::int64_t release_ns;      ///< planned release of the last cycle, CLOCK_MONOTONIC
  std::int64_t spin_sum_ns;     ///< time spun ahead of releases (CmpScheduleOneShot)
  /// How often the task's own kernel timer went off, by the timer's count (CmpScheduleTimer). Beyond `cycles`
  /// these are overruns: as many as `lost_cycles`, as long as the timer was not armed anew in between.
  std::uint64_t timer_expirations;
  std::int64_t interval_ns;  ///< in force since the last cycle; cyclic tasks only
};

/// The statistics of one task, in memory that other processes may map. All zero is valid and empty.
struct TaskStatistics {
  Seqlock<TaskCounters> counters;
  DurationHistogram latency;
};

}  // namespace plchost
