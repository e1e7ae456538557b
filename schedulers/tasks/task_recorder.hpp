#pragma once

#include <atomic>
#include <cstdint>

#include "shm/base/task_statistics.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// One cycle, as its task saw it.
struct RecordedCycle {
  TimePoint release;  ///< planned
  TimePoint start;    ///< of the task's code
  TimePoint end;
  TimePoint ready{};              ///< since when the task could run it; releases before that were lost
  Duration interval{};            ///< of the grid; 0: not a cyclic task, so neither jitter nor slots
  std::uint64_t lost_cycles = 0;  ///< right before it
  std::uint64_t lost_events = 0;
  std::uint64_t timer_expirations = 0;
  Duration spun{};
  std::uint64_t posts_done = 0;  ///< external events: the event's count that it was for
};

/// Writes the statistics of one task. The task's own thread records and never waits. The thread that resets
/// takes them away from it for the moment that takes, and a cycle of that moment counts as one before the
/// reset.
class TaskRecorder {
 public:
  /// Set-up. The statistics count from `now` on.
  TaskRecorder(TaskStatistics& statistics, TimePoint now) noexcept;

  /// Set-up, while the task is parked: the next start ends no period.
  void begin() noexcept { has_start_ = false; }

  /// The task's thread, real-time.
  void record(const RecordedCycle& cycle) noexcept;

  /// Set-up, before the first cycle: the account of posts begins at this count of the event.
  void begin_posts(std::uint64_t count) noexcept { accounted_ = count; }

  /// The posts up to this count of the event are not run any more: those that were neither run nor counted as
  /// lost are lost events. A count that went back, which a stranger wrote, is one. Control thread, while the
  /// task's thread rests.
  void lose_posts(std::uint64_t count) noexcept;

  /// As of the last record(). The task's thread, real-time.
  [[nodiscard]] const TaskCounters& counters() const noexcept { return counters_; }

  /// Everything but the cycle count begins anew, at `now`. False: a record is under way; try again. One
  /// thread at a time, any.
  [[nodiscard]] bool reset(TimePoint now) noexcept;

 private:
  enum class Owner : std::uint32_t { nobody, task, resetter };

  void count(const RecordedCycle& cycle) noexcept;
  void begin_anew() noexcept;
  [[nodiscard]] bool acquire(Owner owner) noexcept;
  void release() noexcept;

  TaskStatistics& statistics_;
  std::atomic<Owner> owner_{Owner::nobody};
  std::atomic<std::uint64_t> cycles_{0};  // the task's thread adds

  // Only the owner.
  std::uint64_t resets_ = 0;
  std::int64_t since_ns_;
  std::int64_t since_unix_ns_;

  // Only the task's thread; the control thread while that rests.
  TaskCounters counters_{};
  std::uint64_t accounted_ = 0;  // posts that were run or lost
  std::uint64_t obeyed_resets_ = 0;
  bool has_start_ = false;
  TimePoint last_start_;
  TimePoint last_release_;
};

}  // namespace plchost
