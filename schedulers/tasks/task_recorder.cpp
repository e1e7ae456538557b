#include "schedulers/tasks/task_recorder.hpp"

#include <algorithm>

#include "shm/base/counted_event.hpp"

namespace plchost {

namespace {

/// Takes a value into its four numbers; the first one of all makes least and greatest.
void add(std::int64_t value, bool first, std::int64_t& last, std::int64_t& sum, std::int64_t& min,
         std::int64_t& max) noexcept {
  last = value;
  sum += value;
  min = first ? value : std::min(min, value);
  max = first ? value : std::max(max, value);
}

/// An end exactly at the next release is in time for it.
std::uint64_t slots(const RecordedCycle& cycle) noexcept {
  if (cycle.interval <= Duration::zero()) return 0;
  const Duration taken = std::max(cycle.end - cycle.release, Duration(1));
  return static_cast<std::uint64_t>((taken + cycle.interval - Duration(1)) / cycle.interval);
}

/// Which posts were run and lost: a reset of the statistics changes nothing of that.
void keep_posts(const TaskCounters& from, TaskCounters& to) noexcept {
  to.posts_done = from.posts_done;
  to.posts_lost_first = from.posts_lost_first;
  to.posts_lost_last = from.posts_lost_last;
}

}  // namespace

TaskRecorder::TaskRecorder(TaskStatistics& statistics, TimePoint now) noexcept
    : statistics_(statistics), since_ns_(now.time_since_epoch().count()), since_unix_ns_(unix_time_ns()) {
  begin_anew();
  statistics_.counters.write(counters_);
}

bool TaskRecorder::acquire(Owner owner) noexcept {
  Owner expected = Owner::nobody;
  // Pairs with release(): the new owner sees what the one before wrote.
  return owner_.compare_exchange_strong(expected, owner, std::memory_order_acquire,
                                        std::memory_order_relaxed);
}

void TaskRecorder::release() noexcept {
  owner_.store(Owner::nobody, std::memory_order_release);
}

void TaskRecorder::record(const RecordedCycle& cycle) noexcept {
  cycles_.store(cycles_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  const bool owns = acquire(Owner::task);
  if (owns && resets_ != obeyed_resets_) begin_anew();
  const bool is_period = has_start_ && cycle.interval > Duration::zero();
  count(cycle);
  if (owns) {
    statistics_[TaskHistogram::latency].record(cycle.start - cycle.release);
    statistics_[TaskHistogram::execution].record(cycle.end - cycle.start);
    if (is_period) {
      const Duration jitter(counters_.jitter_last_ns);
      const auto half =
          jitter < Duration::zero() ? TaskHistogram::jitter_negative : TaskHistogram::jitter_positive;
      statistics_[half].record(std::chrono::abs(jitter));
    }
    statistics_.counters.write(counters_);
    release();
  }
  accounted_ = cycle.posts_done;
  last_start_ = cycle.start;
  last_release_ = cycle.release;
  has_start_ = true;
}

void TaskRecorder::lose_posts(std::uint64_t count) noexcept {
  const std::uint64_t missing = count - accounted_;
  if (missing == 0) return;
  accounted_ = count;
  // A cycle that did not come to its end holds nothing: the thread that resets is the only other owner.
  const bool owns = acquire(Owner::task);
  if (owns && resets_ != obeyed_resets_) begin_anew();
  const std::uint64_t lost = missing > CountedEvent::kCountMask ? 1 : missing;
  counters_.lost_events += lost;
  counters_.posts_lost_first = count - lost + 1;
  counters_.posts_lost_last = count;
  if (!owns) return;
  statistics_.counters.write(counters_);
  release();
}

void TaskRecorder::begin_anew() noexcept {
  const std::int64_t interval_ns = counters_.interval_ns;
  const TaskCounters before = counters_;
  counters_ = TaskCounters{};
  counters_.interval_ns = interval_ns;
  keep_posts(before, counters_);
  counters_.cycles = cycles_.load(std::memory_order_relaxed);
  counters_.since_ns = since_ns_;
  counters_.since_unix_ns = since_unix_ns_;
  obeyed_resets_ = resets_;
}

void TaskRecorder::count(const RecordedCycle& cycle) noexcept {
  TaskCounters& now = counters_;
  const bool first = now.recorded == 0;
  add((cycle.end - cycle.start).count(), first, now.exec_last_ns, now.exec_sum_ns, now.exec_min_ns,
      now.exec_max_ns);
  add((cycle.start - cycle.release).count(), first, now.latency_last_ns, now.latency_sum_ns,
      now.latency_min_ns, now.latency_max_ns);
  if (cycle.interval > Duration::zero() && has_start_) {
    // Against what was planned: neither lost cycles nor a change of the interval are jitter.
    const Duration planned = cycle.release - last_release_;
    add(((cycle.start - last_start_) - planned).count(), now.periods == 0, now.jitter_last_ns,
        now.jitter_sum_ns, now.jitter_min_ns, now.jitter_max_ns);
    ++now.periods;
  }
  now.cycles = cycles_.load(std::memory_order_relaxed);
  ++now.recorded;
  now.lost_cycles += cycle.lost_cycles;
  now.lost_consecutive = cycle.lost_cycles;
  now.lost_consecutive_max = std::max(now.lost_consecutive_max, cycle.lost_cycles);
  if (cycle.lost_cycles > 0) {
    const auto of_last = [this](TimePoint time) { return has_start_ ? time.time_since_epoch().count() : 0; };
    now.last_loss = {.release_ns = of_last(last_release_),
                     .start_ns = of_last(last_start_),
                     .end_ns = cycle.ready.time_since_epoch().count(),
                     .lost = cycle.lost_cycles};
  }
  now.lost_events += cycle.lost_events;
  if (cycle.lost_events > 0) {
    now.posts_lost_first = cycle.posts_done - cycle.lost_events;
    now.posts_lost_last = cycle.posts_done - 1;
  }
  now.posts_done = cycle.posts_done;
  now.timer_expirations += cycle.timer_expirations;
  now.slots_last = slots(cycle);
  now.slots_max = std::max(now.slots_max, now.slots_last);
  now.release_ns = cycle.release.time_since_epoch().count();
  now.interval_ns = cycle.interval.count();
  now.spin_sum_ns += cycle.spun.count();
}

bool TaskRecorder::reset(TimePoint now) noexcept {
  if (!acquire(Owner::resetter)) return false;
  for (DurationHistogram& histogram : statistics_.histograms) histogram.clear();
  ++resets_;
  since_ns_ = now.time_since_epoch().count();
  since_unix_ns_ = unix_time_ns();
  TaskCounters fresh{};
  fresh.cycles = cycles_.load(std::memory_order_relaxed);
  if (const auto before = statistics_.counters.read()) {
    fresh.interval_ns = before->interval_ns;
    keep_posts(*before, fresh);
  }
  fresh.since_ns = since_ns_;
  fresh.since_unix_ns = since_unix_ns_;
  statistics_.counters.write(fresh);
  release();
  return true;
}

}  // namespace plchost
