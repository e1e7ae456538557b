// How the tasks of a set come to rest: at the end of their cycles, in two phases; and the single cycle, which
// ends the same way.
#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "schedulers/activation/single_cycle.hpp"
#include "schedulers/task_set.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr Duration kLook = std::chrono::milliseconds(1);

}  // namespace

Result<void> TaskSet::begin_stop(const StopLimits& limits) {
  if (!running_) return failure(ErrorCode::wrong_state, "the tasks are not running");
  if (stop_) return failure(ErrorCode::wrong_state, "the tasks are being stopped already");
  stop_ = Stop{
      .limits = limits, .others = false, .hurried = false, .deadline = {}, .judged_from = {}, .stuck = {}};
  late_variable_.reset();
  // From now on releases are missed on purpose; cycles that run are watched on.
  if (supervision_) supervision_->tasks_stop();
  environment_.control_flight.put(clock_.now(), FlightKind::stopping);
  park_tasks(true);
  // Only now: a delay of this thread's question is no time that the tasks have had.
  stop_->deadline = MonotonicClock::now() + limits.outputs;
  return {};
}

void TaskSet::park_tasks(bool that_drive_outputs) {
  const auto is_meant = [&](std::size_t i) {
    return tasks_[i]->config().drives_outputs == that_drive_outputs;
  };
  for (std::size_t i = 0; i < threads_.size(); ++i) {
    if (is_meant(i)) threads_[i]->park();
  }
  // Only now: a post of which the poster is told that no task takes it must not be run.
  for (std::size_t i = 0; i < threads_.size(); ++i) {
    if (is_meant(i) && environment_.to_park) environment_.to_park(i);
  }
}

void TaskSet::begin_second_phase() {
  stop_->others = true;
  stop_->judged_from = {};
  // Before the tasks, so that nothing releases them; but a thread in an event variable gets the phase's time.
  ticker_.use(nullptr);
  (void)ticker_.settled(MonotonicClock::now() + kSecondLook);
  park_tasks(false);
  stop_->deadline = MonotonicClock::now() + stop_->limits.others;
}

// The tasks of this phase, or left over from the first one, that have not parked yet.
std::vector<std::size_t> TaskSet::busy_in_phase() {
  std::vector<std::size_t> busy;
  for (std::size_t i = 0; i < threads_.size(); ++i) {
    const bool given_up = std::ranges::find(stop_->stuck, i) != stop_->stuck.end();
    if (given_up || (!stop_->others && !tasks_[i]->config().drives_outputs)) continue;
    if (threads_[i]->settled(TimePoint{})) {
      report(i, false);
    } else {
      busy.push_back(i);
    }
  }
  return busy;
}

bool TaskSet::runs_code(std::size_t task) const noexcept {
  return tasks_[task]->trap().running_since().has_value();
}

// The tasks that are stuck when the phase is over; nothing: it is not over. No task is at the first look
// after the deadline: the whole host, or this core, may have stood still until then. A task that is between
// two cycles only waits for the processor, which a stuck task may keep from it.
std::optional<std::vector<std::size_t>> TaskSet::stuck_in_phase(const std::vector<std::size_t>& busy) {
  const bool ended = !stop_->others || ticker_.settled(TimePoint{});
  if ((busy.empty() && ended) || stop_->hurried) return busy;
  const TimePoint now = MonotonicClock::now();
  if (now < stop_->deadline) return std::nullopt;
  if (!stop_->judged_from) stop_->judged_from = now + kSecondLook;
  if (now < *stop_->judged_from) return std::nullopt;
  std::vector<std::size_t> inside;
  std::ranges::copy_if(busy, std::back_inserter(inside), [&](std::size_t task) { return runs_code(task); });
  // The limit is the stop's, not kVariablePatience: a stop names the task, and puts it into no exception.
  const auto variable = task_in_variable();
  if (!ended && variable) {
    late_variable_ = variable;
    if (std::ranges::find(inside, *variable) == inside.end()) inside.push_back(*variable);
  }
  // The variable is judged in the second phase, and so are the tasks that wait for it.
  if (!inside.empty() || (!stop_->others && variable)) return inside;
  if (now < *stop_->judged_from + kIdlePatience) return std::nullopt;
  return busy;
}

std::optional<std::vector<std::size_t>> TaskSet::advance_stop() {
  if (!stop_) return std::vector<std::size_t>{};
  for (;;) {
    const auto busy = busy_in_phase();
    const auto stuck = stuck_in_phase(busy);
    if (!stuck) return std::nullopt;
    stop_->stuck.insert(stop_->stuck.end(), stuck->begin(), stuck->end());
    if (stop_->others) break;
    begin_second_phase();
  }
  auto stuck = std::move(stop_->stuck);
  stop_.reset();
  note_left_out();
  retired_.push_back(std::move(active_));
  running_ = false;
  if (stuck.empty() && let_retired_go() && supervision_) supervision_->end();
  look_after_posts();
  return stuck;
}

void TaskSet::note_left_out() {
  left_out_.clear();
  if (!active_->single_cycle) return;
  for (std::size_t turn = 0; turn < single_cycle_order_.size(); ++turn) {
    const std::size_t task = single_cycle_order_[turn];
    if (!active_->single_cycle->has_begun(turn) && !tasks_[task]->fault().raised()) left_out_.push_back(task);
  }
}

void TaskSet::park_all() {
  if (!running_) return;
  if (!stop_) (void)begin_stop({});
  stop_->hurried = true;
  (void)advance_stop();
}

Result<void> TaskSet::stop(Duration limit) {
  if (auto begun = begin_stop({.outputs = limit, .others = limit}); !begun) return begun;
  for (;;) {
    if (const auto stuck = advance_stop()) {
      if (stuck->empty()) return {};
      return failure(ErrorCode::timed_out,
                     fmt::format("not at the end of its cycle after {} ms: task {}",
                                 std::chrono::duration_cast<std::chrono::milliseconds>(limit).count(),
                                 names_of(*stuck)));
    }
    const auto busy = busy_in_phase();
    const TimePoint next_look = MonotonicClock::now() + kLook;
    if (!busy.empty()) {
      (void)threads_[busy.front()]->settled(next_look);
    } else if (stop_->others) {
      (void)ticker_.settled(next_look);
    }
  }
}

std::string TaskSet::names_of(const std::vector<std::size_t>& tasks) const {
  std::vector<std::string_view> names;
  for (const std::size_t task : tasks) names.emplace_back(tasks_[task]->config().name);
  return join_names(names);
}

Result<void> TaskSet::begin_single_cycle(const SchedulerSettings& settings,
                                         const std::function<void()>& before) {
  PLCHOST_TRY(check_startable());
  if (before) before();
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    if (tasks_[i]->kind().timed) order.push_back(i);
  }
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return tasks_[i]->config().iec_priority; });
  auto arrangement = std::make_unique<Arrangement>();
  arrangement->single_cycle = std::make_unique<SingleCycle>(clock_);
  arrangement->sources.resize(tasks_.size());
  for (const std::size_t i : order) arrangement->sources[i] = arrangement->single_cycle->add();
  active_ = std::move(arrangement);
  const TimePoint origin = clock_.now();
  for (const std::size_t i : order) tasks_[i]->begin(origin);
  running_ = true;
  single_cycle_order_ = order;
  watch(settings);
  if (supervision_) supervision_->tasks_stop();  // no release is missed; each cycle is watched
  for (const std::size_t i : order) {
    threads_[i]->use(active_->sources[i].get());
    report(i, true);
  }
  active_->single_cycle->begin();
  return {};
}

bool TaskSet::single_cycle_done() noexcept {
  if (!active_ || !active_->single_cycle) return true;
  SingleCycle& round = *active_->single_cycle;
  // A task whose fault has stopped only itself hands its turn on to nobody.
  for (std::size_t turn = round.turn(); turn < single_cycle_order_.size(); turn = round.turn()) {
    if (!tasks_[single_cycle_order_[turn]]->fault().raised()) return false;
    round.skip(turn);
  }
  return true;
}

}  // namespace plchost
