#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "shm/base/duration_histogram.hpp"
#include "shm/base/seqlock.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Cycles that a task lost, and the cycle that kept it from them. Times by CLOCK_MONOTONIC.
struct CycleLoss {
  std::int64_t release_ns;  ///< planned release of the cycle before; 0, as the start: none had run yet
  std::int64_t start_ns;    ///< of that cycle
  std::int64_t end_ns;      ///< the task was ready again: that cycle and the runtime's work behind it ended
  std::uint64_t lost;       ///< releases that passed until then
};

/// The counters of a task. Durations in nanoseconds. Everything but `cycles` and `posts_...` counts from the
/// last reset.
struct TaskCounters {
  std::uint64_t cycles;      ///< the IEC cycle count: cycles that ran, whatever was reset
  std::uint64_t posts_done;  ///< external events: the post, by the event's count, whose cycle ended last
  std::uint64_t posts_lost_first;  ///< external events: of the posts that were lost last, the first by the
                                   ///< event's count; 0: none was lost
  std::uint64_t posts_lost_last;   ///< and the last
  std::uint64_t recorded;          ///< cycles since the last reset: the divisor of sums
  std::uint64_t lost_cycles;       ///< releases on the grid that passed without a cycle
  std::uint64_t lost_consecutive;  ///< those in a row right before the last cycle
  std::uint64_t lost_consecutive_max;  ///< the longest such row
  CycleLoss last_loss;                 ///< all 0: none since the last reset
  std::uint64_t lost_events;           ///< external events that no cycle was run for
  std::int64_t exec_last_ns;           ///< start of the task's code to its end
  std::int64_t exec_sum_ns;
  std::int64_t exec_min_ns;
  std::int64_t exec_max_ns;
  std::int64_t latency_last_ns;  ///< start - planned release
  std::int64_t latency_sum_ns;
  std::int64_t latency_min_ns;
  std::int64_t latency_max_ns;
  std::uint64_t periods;        ///< from start to start, as many as were measured; cyclic tasks only
  std::int64_t jitter_last_ns;  ///< period jitter, signed: (start - start before) - planned distance
  std::int64_t jitter_sum_ns;
  std::int64_t jitter_min_ns;  ///< the period that was too short by most, as a negative number
  std::int64_t jitter_max_ns;  ///< the period that was too long by most
  std::uint64_t slots_last;  ///< periods of its grid that the last cycle touched; 1: it ended within its own
  std::uint64_t slots_max;
  std::int64_t release_ns;   ///< planned release of the last cycle, CLOCK_MONOTONIC
  std::int64_t spin_sum_ns;  ///< time spun ahead of releases (CmpScheduleOneShot)
  /// How often the task's own kernel timer went off, by the timer's count (CmpScheduleTimer). Beyond
  /// `recorded` these are releases of lost cycles: as many as `lost_cycles`, as long as the timer was not
  /// armed anew in between.
  std::uint64_t timer_expirations;
  std::int64_t interval_ns;    ///< in force since the last cycle; cyclic tasks only
  std::int64_t since_ns;       ///< the last reset, or when the task was made; CLOCK_MONOTONIC
  std::int64_t since_unix_ns;  ///< the same, CLOCK_REALTIME
};

// Counters may come out of memory that a stranger has written to: no value of them does harm below.

[[nodiscard]] constexpr std::int64_t average(std::int64_t sum, std::uint64_t count) noexcept {
  const auto divisor = static_cast<std::int64_t>(std::min<std::uint64_t>(count, INT64_MAX));
  return divisor == 0 ? 0 : sum / divisor;
}
/// The largest deviation of a period, in either direction.
[[nodiscard]] constexpr std::int64_t largest_jitter_ns(const TaskCounters& counters) noexcept {
  return std::max(counters.jitter_max_ns, -std::max(counters.jitter_min_ns, -INT64_MAX));
}

/// The histograms of a task, in the order of their buckets in its memory.
enum class TaskHistogram : std::uint8_t {
  latency,
  execution,
  jitter_negative,  ///< magnitudes of the deviations below zero
  jitter_positive,  ///< zero is here
  count,
};
inline constexpr auto kTaskHistograms = static_cast<std::size_t>(TaskHistogram::count);
/// Up to so many tasks have histograms of 3 significant digits (352 KiB a task), more have 2 (50 KiB), unless
/// the settings say otherwise.
inline constexpr std::uint32_t kMaxFineTasks = 64;
[[nodiscard]] constexpr std::size_t task_bucket_count(HistogramShape shape) noexcept {
  return kTaskHistograms * shape.bucket_count();
}

/// The statistics of one task, for their one writer (TaskRecorder). They lie in memory that other processes
/// may map; all zero is valid and empty. Readers are never in the writer's way.
class TaskStatistics {
 public:
  /// In memory of their own. Set-up.
  explicit TaskStatistics(unsigned digits = HistogramShape::kCoarse)
      : TaskStatistics(HistogramShape(digits), std::make_unique<Memory>(HistogramShape(digits))) {}
  /// In the memory of somebody else. `buckets`: task_bucket_count(shape) of them.
  TaskStatistics(HistogramShape shape, Seqlock<TaskCounters>& place, HistogramBuckets buckets) noexcept
      : counters(place), histograms(all_of(shape, buckets, std::make_index_sequence<kTaskHistograms>())) {}

  Seqlock<TaskCounters>& counters;
  std::array<DurationHistogram, kTaskHistograms> histograms;
  [[nodiscard]] DurationHistogram& operator[](TaskHistogram which) noexcept {
    return histograms[static_cast<std::size_t>(which)];
  }

  /// Where the buckets of one histogram lie among all of a task.
  template <class Buckets>
  [[nodiscard]] static Buckets part(HistogramShape shape, Buckets all, TaskHistogram which) noexcept {
    return all.subspan(static_cast<std::size_t>(which) * shape.bucket_count(), shape.bucket_count());
  }

 private:
  template <std::size_t... Which>
  [[nodiscard]] static std::array<DurationHistogram, kTaskHistograms> all_of(
      HistogramShape shape, HistogramBuckets buckets, std::index_sequence<Which...> /*all*/) noexcept {
    return {DurationHistogram(shape, part(shape, buckets, static_cast<TaskHistogram>(Which)))...};
  }
  struct Memory {
    explicit Memory(HistogramShape shape) : buckets(task_bucket_count(shape)) {}
    Seqlock<TaskCounters> counters;
    std::vector<std::atomic<std::uint32_t>> buckets;
  };
  TaskStatistics(HistogramShape shape, std::unique_ptr<Memory> memory) noexcept
      : TaskStatistics(shape, memory->counters, memory->buckets) {
    memory_ = std::move(memory);
  }

  std::unique_ptr<Memory> memory_;  // null if it is somebody else's
};

}  // namespace plchost
