#include "schedulers/tasks/task.hpp"

#include <utility>

#include "schedulers/faults/throw_probe.hpp"
#include "schedulers/tasks/event_latch.hpp"

namespace plchost {

namespace {

// Of the task whose code this thread runs.
thread_local FlightRing* flight_of_thread = nullptr;

}  // namespace

FlightRing* Task::flight_here() noexcept {
  return flight_of_thread;
}

Task::Task(Clock& clock, TaskConfig config, TaskStatistics& statistics, CountedEvent* event,
           FaultBoard* board) noexcept
    : clock_(clock),
      config_(std::move(config)),
      kind_(find_task_kind(config_.kind)),
      recorder_(statistics, clock.now()),
      state_(kind_->make({.clock = clock, .config = config_, .event = event})),
      overruns_(config_.watchdog),
      fault_(board, config_.watchdog.policy) {
  if (event != nullptr) recorder_.begin_posts(event->count());
}

void Task::begin(TimePoint origin, bool takes_posts) {
  state_->begin(origin, takes_posts);
  ready_ = origin;
  overruns_.forgive_next();
  recorder_.begin();
  if (state_->event() != nullptr) recorder_.lose_posts(state_->posts_done());
}

bool Task::raise_event() noexcept {
  EventLatch* const latch = state_->latch();
  if (latch == nullptr) return false;
  latch->raise();
  return true;
}

void Task::rouse() noexcept {
  CountedEvent* const event = state_->event();
  if (event != nullptr && event->count() != state_->slept_at()) event->rouse();
}

void Task::lose_posts() noexcept {
  if (const CountedEvent* const event = state_->event()) recorder_.lose_posts(event->count());
}

std::optional<Task::Demand> Task::demand(TimePoint now) const noexcept {
  const Demand demand{.cycle_since = trap_.running_since(), .due = due(), .posts = state_->slept_at()};
  if (fault_.halts() || !free_since()) return std::nullopt;
  if (demand.cycle_since || state_->is_due(now)) return demand;
  return std::nullopt;
}

std::optional<TimePoint> Task::free_since() const noexcept {
  if (trap_.seat().at_work()) return std::nullopt;
  return TimePoint(Duration(free_since_.load(std::memory_order_relaxed)));
}

Task::Pace Task::pace() const noexcept {
  return {.lost = lost_.load(std::memory_order_relaxed), .on_time = on_time_.load(std::memory_order_relaxed)};
}

// false: it did not come to its end.
bool Task::run_entry() noexcept {
  flight_of_thread = &flight_;
  bool ended = false;
  try {
    config_.entry();
    ended = true;
  } catch (const ThrowProbe&) {  // never: it only looks at the stack
  } catch (...) {
    raise_current_exception(fault_);
  }
  flight_of_thread = nullptr;
  return ended;
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
  const CycleGate::Stay within(gate_, trap_.seat(), clock_);
  single_cycle_ = activation.single_cycle;
  state_->cycle_begins(activation.release);
  const TimePoint start = clock_.now();
  tell_start(activation, start);
  if (config_.before_entry) config_.before_entry();
  const TimePoint entered = config_.before_entry ? clock_.now() : start;
  trap_.arm(fault_, entered);
  const bool ended = run_entry();
  trap_.disarm();
  if (!ended) return;
  const TimePoint left = clock_.now();
  if (config_.after_entry) config_.after_entry();
  const TimePoint end = config_.after_entry ? clock_.now() : left;
  const Duration still = std::exchange(stood_still_, Duration::zero());
  flight_.put(end, FlightKind::end, activation.spun.count());
  if (const Duration by = state_->cycle_ended(activation.release, end); by != Duration::zero()) {
    flight_.put(end, FlightKind::moved, by.count());
  }
  if (still > Duration::zero()) pass_over(end, still);
  record(activation, start, end - still, std::exchange(ready_, end));
  if (config_.after_cycle) config_.after_cycle(recorder_.counters());
  look_at_overrun(left - entered - still);
  if (config_.between_cycles) work_between_cycles();
}

void Task::tell_start(const Activation& activation, TimePoint start) noexcept {
  if (activation.lost_cycles > 0) {
    flight_.put(start, FlightKind::lost, static_cast<std::int64_t>(activation.lost_cycles));
  }
  if (state_->event() != nullptr) {
    flight_.put(start, FlightKind::taken, static_cast<std::int64_t>(state_->posts_done()));
  }
  flight_.put(start, FlightKind::start, (start - activation.release).count());
}

void Task::stand_still(const std::function<void()>& wait) noexcept {
  const TimePoint from = clock_.now();
  flight_.put(from, FlightKind::halted);
  const TimePoint start = trap_.seat().stands_still();
  EventLatch* const latch = state_->latch();
  if (latch != nullptr) lost_before_ = latch->lost();
  wait();
  if (latch != nullptr) count_passed(latch->take_lost_since(lost_before_));
  const TimePoint to = clock_.now();
  flight_.put(to, FlightKind::resumed);
  stood_still_ += to - from;
  // Before the seat is taken: releases of that time are not omitted.
  free_since_.store(to.time_since_epoch().count(), std::memory_order_relaxed);
  trap_.seat().goes_on(gate_, clock_, start + (to - from));
}

void Task::pass_over(TimePoint end, Duration still) noexcept {
  if (!single_cycle_) count_passed(state_->pass_over(end, still));
}

void Task::count_passed(std::uint64_t releases) noexcept {
  passed_.store(passed_.load(std::memory_order_relaxed) + releases, std::memory_order_relaxed);
}

std::uint64_t Task::releases_passing(Duration still) const noexcept {
  if (const EventLatch* const latch = state_->latch()) return latch->lost() - lost_before_;
  const Duration interval = single_cycle_ ? Duration() : interval_in_force();
  return interval > Duration() ? static_cast<std::uint64_t>(still / interval) : 0;
}

void Task::work_between_cycles() noexcept {
  trap_.seat().work_begins();
  // Releases that fall due meanwhile are lost, as during a cycle.
  if (config_.between_cycles()) {
    const TimePoint end = clock_.now();
    flight_.put(end, FlightKind::work, (end - ready_).count());
    ready_ = end;
  }
  free_since_.store(ready_.time_since_epoch().count(), std::memory_order_relaxed);
  trap_.seat().part_ends();
}

void Task::record(const Activation& activation, TimePoint start, TimePoint end, TimePoint ready) noexcept {
  std::atomic<std::uint64_t>& count = activation.lost_cycles > 0 ? lost_ : on_time_;
  const std::uint64_t more = activation.lost_cycles > 0 ? activation.lost_cycles : 1;
  count.store(count.load(std::memory_order_relaxed) + more, std::memory_order_relaxed);
  recorder_.record({.release = activation.release,
                    .start = start,
                    .end = end,
                    .ready = ready,
                    .interval = interval_in_force(),
                    .lost_cycles = activation.lost_cycles,
                    .lost_events = activation.lost_events,
                    .timer_expirations = activation.timer_expirations,
                    .spun = activation.spun,
                    .posts_done = state_->posts_done()});
}

}  // namespace plchost
