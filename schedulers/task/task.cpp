#include "schedulers/task/task.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace plchost {

namespace {

constexpr Duration::rep kAtWork = -1;

// Before begin() it is not used; no grid can have an interval of 0.
Duration grid_interval(const TaskConfig& config) noexcept {
  return std::max(config.interval, Duration(1));
}

}  // namespace

Task::Task(Clock& clock, TaskConfig config, TaskStatistics& statistics, CountedEvent* event,
           FaultBoard* board) noexcept
    : clock_(clock),
      config_(std::move(config)),
      event_(event),
      recorder_(statistics, clock.now()),
      grid_(TimePoint{}, grid_interval(config_), config_.late),
      wanted_interval_(grid_.interval().count()),
      overruns_(config_.watchdog),
      fault_(board, config_.watchdog.policy) {
  if (event_ != nullptr) recorder_.begin_posts(event_->count());
}

void Task::begin(TimePoint origin, bool takes_posts) {
  grid_ = ReleaseGrid(origin + config_.start_offset,
                      Duration(wanted_interval_.load(std::memory_order_relaxed)), config_.late);
  ready_ = origin;
  begun_ = false;
  set_due(origin + config_.start_offset);
  overruns_.forgive_next();
  recorder_.begin();
  if (event_ != nullptr) {
    const std::uint64_t count = takes_posts ? event_->set_taken(true).count() : event_->count();
    recorder_.lose_posts(count);
    cursor_ = {.next = count, .seen = count, .seen_at = origin};
  }
}

Activation Task::next_release(const FreewheelRule& rule) const noexcept {
  if (config_.kind == TaskKind::freewheeling) {
    const Duration sleep = begun_ ? rule.sleep_after(last_execution_) : Duration::zero();
    return {.release = ready_ + sleep};
  }
  const auto [release, lost_cycles] = grid_.plan(ready_);
  return {.release = release, .lost_cycles = lost_cycles};
}

bool Task::set_interval(Duration interval) noexcept {
  if (config_.kind != TaskKind::cyclic) return false;
  if (interval < kMinRuntimeInterval || interval > kMaxInterval) return false;
  wanted_interval_.store(interval.count(), std::memory_order_relaxed);
  return true;
}

bool Task::raise_event() noexcept {
  if (config_.kind != TaskKind::event) return false;
  latch_.raise();
  return true;
}

Duration Task::interval() const noexcept {
  if (config_.kind != TaskKind::cyclic) return Duration::zero();
  return Duration(wanted_interval_.load(std::memory_order_relaxed));
}

std::optional<Task::Demand> Task::demand(TimePoint now) const noexcept {
  const Demand demand{
      .cycle_since = trap_.running_since(), .due = due(), .posts = slept_at_.load(std::memory_order_relaxed)};
  if (fault_.halts() || !free_since()) return std::nullopt;
  if (demand.cycle_since) return demand;
  const bool is_due = demand.due && *demand.due < now;
  const bool is_posted = event_ != nullptr && event_->count() != demand.posts;
  if (is_due || is_posted || latch_.is_due()) return demand;
  return std::nullopt;
}

std::optional<TimePoint> Task::free_since() const noexcept {
  const auto since = free_since_.load(std::memory_order_relaxed);
  if (since == kAtWork) return std::nullopt;
  return TimePoint(Duration(since));
}

std::optional<TimePoint> Task::due() const noexcept {
  if (config_.kind != TaskKind::cyclic) return std::nullopt;
  return TimePoint(Duration(due_.load(std::memory_order_relaxed)));
}

Task::Pace Task::pace() const noexcept {
  return {.lost = lost_.load(std::memory_order_relaxed), .on_time = on_time_.load(std::memory_order_relaxed)};
}

void Task::set_due(TimePoint due) noexcept {
  due_.store(due.time_since_epoch().count(), std::memory_order_relaxed);
}

// false: it did not come to its end.
bool Task::run_entry() noexcept {
  try {
    config_.entry();
    return true;
  } catch (...) {
    raise_current_exception(fault_);
  }
  return false;
}

void Task::look_at_overrun(Duration execution) noexcept {
  const OverrunRule::Verdict verdict = overruns_.ended(execution);
  if (verdict == OverrunRule::Verdict::fine || !fault_.claim()) return;
  const bool one = verdict == OverrunRule::Verdict::too_long;
  FaultRecord& record = fault_.record();
  record.kind = one ? FaultKind::task_watchdog : FaultKind::consecutive_overruns;
  record.figure = execution.count();
  record.limit = one ? overruns_.limit().count() : overruns_.time().count();
  record.count = overruns_.in_a_row();
  fault_.publish();
}

void Task::run_cycle(const Activation& activation) noexcept {
  const CycleGate::Stay within(gate_, seat_, clock_);
  // Only a freewheeling task sleeps by what it used itself, so only there it is worth the system calls.
  const bool by_own_time = config_.kind == TaskKind::freewheeling;
  const Duration used_before = by_own_time ? clock_.thread_time() : Duration::zero();
  const TimePoint start = clock_.now();
  set_due(activation.release + interval());
  if (config_.before_entry) config_.before_entry();
  const TimePoint entered = config_.before_entry ? clock_.now() : start;
  trap_.arm(fault_, entered);
  const bool ended = run_entry();
  trap_.disarm();
  if (!ended) return;
  const TimePoint left = clock_.now();
  if (config_.after_entry) config_.after_entry();
  const TimePoint end = config_.after_entry ? clock_.now() : left;
  if (by_own_time) last_execution_ = clock_.thread_time() - used_before;
  grid_.set_interval(Duration(wanted_interval_.load(std::memory_order_relaxed)));
  grid_.ran(activation.release);
  if (follower_ != nullptr) {
    grid_.shift(follower_->correction(grid_.next(), grid_.interval(), config_.start_offset, end));
  }
  ready_ = end;
  record(activation, start, end);
  if (config_.after_cycle) config_.after_cycle(recorder_.counters());
  look_at_overrun(left - entered);
  if (config_.between_cycles) work_between_cycles();
}

void Task::work_between_cycles() noexcept {
  free_since_.store(kAtWork, std::memory_order_relaxed);
  // Releases that fall due meanwhile are lost, as during a cycle.
  if (config_.between_cycles()) ready_ = clock_.now();
  free_since_.store(ready_.time_since_epoch().count(), std::memory_order_relaxed);
}

void Task::record(const Activation& activation, TimePoint start, TimePoint end) noexcept {
  begun_ = true;
  std::atomic<std::uint64_t>& count = activation.lost_cycles > 0 ? lost_ : on_time_;
  const std::uint64_t more = activation.lost_cycles > 0 ? activation.lost_cycles : 1;
  count.store(count.load(std::memory_order_relaxed) + more, std::memory_order_relaxed);
  recorder_.record({.release = activation.release,
                    .start = start,
                    .end = end,
                    .interval = config_.kind == TaskKind::cyclic ? grid_.interval() : Duration::zero(),
                    .lost_cycles = activation.lost_cycles,
                    .lost_events = activation.lost_events,
                    .timer_expirations = activation.timer_expirations,
                    .spun = activation.spun,
                    .posts_done = cursor_.next});
}

}  // namespace plchost
