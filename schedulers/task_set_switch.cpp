// How the tasks of a set come under a scheduler, at a start and at an exchange.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "schedulers/policies/registry.hpp"
#include "schedulers/task_set.hpp"
#include "schedulers/tasks/priorities.hpp"
#include "shm/base/names.hpp"

namespace plchost {

auto TaskSet::arrange(std::string_view name, const SchedulerSettings& settings)
    -> Result<std::unique_ptr<Arrangement>> {
  PLCHOST_TRY_ASSIGN(const auto entry, find_scheduler(name));
  PLCHOST_TRY(check_settings(settings));
  auto arrangement = std::make_unique<Arrangement>();
  arrangement->tick = choose_tick(settings, *environment_.devices, tick_.device);
  const auto& device = arrangement->tick.device;
  arrangement->scheduler = entry->make(
      {.clock = clock_, .settings = settings, .tick_frequency = device ? device->frequency() : 0});
  if (arrangement->scheduler->capabilities().one_shot) {
    PLCHOST_TRY(check_one_shot(name, arrangement->tick));
  }
  for (auto& task : tasks_) {
    if (auto own = task->own_source(settings.max_event_backlog)) {
      arrangement->sources.push_back(std::move(own));
      continue;
    }
    auto source = arrangement->scheduler->source_for(*task);
    if (!source) {
      return failure_in(fmt::format("{}: task '{}'", name, task->config().name), std::move(source.error()));
    }
    arrangement->sources.push_back(std::move(*source));
  }
  PLCHOST_TRY(in_step(name, in_step("tick source", plan_ticks(*arrangement, settings))));
  return arrangement;
}

// The ticker runs only for a scheduler that ticks, or for event variables. Those alone are looked at between
// the releases of the cyclic tasks: at the same instant the look, which goes first, would delay them.
Result<void> TaskSet::plan_ticks(Arrangement& arrangement, const SchedulerSettings& settings) {
  const bool ticks = arrangement.scheduler->capabilities().ticks &&
                     std::ranges::any_of(tasks_, [](const auto& task) { return task->kind().timed; });
  if (!ticks && poller_.empty()) return {};
  PLCHOST_TRY_ASSIGN(auto source, make_tick_source(clock_, arrangement.tick));
  arrangement.plan = {.source = std::move(source),
                      .scheduler = ticks ? arrangement.scheduler.get() : nullptr,
                      .origin = {},
                      .period = settings.scheduler_interval,
                      .max_backlog = settings.max_event_backlog};
  return {};
}

// Returns when it ticks so. false: an event variable does not return, and all tasks are in exception.
bool TaskSet::tick_by(Arrangement& arrangement) {
  TickPlan& plan = arrangement.plan;
  plan.origin = plan.scheduler != nullptr ? origin_ : origin_ + plan.period / 2;
  ticker_.use(plan.source ? &plan : nullptr);
  return ticker_follows();
}

Result<TaskSet::Prepared> TaskSet::prepare(std::string_view scheduler, const SchedulerSettings& settings) {
  PLCHOST_TRY(check_startable());
  if (tick_.device && tick_.device->fault() != TickFault::none) tick_ = {};  // is opened anew
  PLCHOST_TRY_ASSIGN(auto arrangement, arrange(scheduler, settings));
  return Prepared(std::move(arrangement), settings);
}

Result<void> TaskSet::check_startable() {
  if (running_) return failure(ErrorCode::wrong_state, "the tasks are running already");
  if (const auto busy = wait_until_settled(TimePoint{}); !busy.empty()) {
    return failure(ErrorCode::wrong_state,
                   fmt::format("has not ended its cycle since it was to stop: task {}", join_names(busy)));
  }
  if (const auto faulty = tasks_in_exception(); !faulty.empty()) {
    return failure(ErrorCode::wrong_state,
                   fmt::format("in exception: task {}; reset first", join_names(faulty)));
  }
  if (!retired_.empty()) return failure(ErrorCode::wrong_state, "the last tick has not ended yet");
  return {};
}

Result<void> TaskSet::start(std::string_view scheduler, const SchedulerSettings& settings) {
  PLCHOST_TRY_ASSIGN(auto prepared, prepare(scheduler, settings));
  start(std::move(prepared));
  return {};
}

void TaskSet::start(Prepared prepared) {
  const SchedulerSettings& settings = prepared.settings_;
  active_ = std::move(prepared.arrangement_);
  tick_ = active_->tick;
  distributed_clock_.configure(settings.distributed_clock);
  distributed_clock_.set_steering(active_->scheduler->capabilities().one_shot);
  for (auto& task : tasks_) task->forget_edges();
  running_ = true;
  watch_variables(settings);
  // The releases after the reading are one grid, and lose nothing by it, however long the variables take.
  if (!poller_.empty()) ticker_.use(&first_look_);
  const bool looked = ticker_follows();
  {
    // Nobody but the tasks may come between the origin and the moment in which the last task has its source.
    const RaisedPriority raised(environment_.allow_unprivileged ? ThreadPriority{} : switch_priority(band_));
    origin_ = clock_.now() + kStartLead;
    for (auto& task : tasks_) task->begin(origin_, /*takes_posts=*/true);
    watch(settings);
    if (looked) (void)tick_by(*active_);
    hand_out_sources();
    environment_.control_flight.put(clock_.now(), FlightKind::started);
  }
  // All, also a task whose thread gets no core for longer than this waits: nobody would look again.
  for (std::size_t i = 0; i < tasks_.size(); ++i) report(i, true);
  (void)wait_until_settled(MonotonicClock::now() + kSwitchPatience);
}

Result<void> TaskSet::switch_to(std::string_view scheduler, const SchedulerSettings& settings) {
  if (!running_ || stop_ || !active_->scheduler) {
    return failure(ErrorCode::wrong_state,
                   "the tasks are not running: start them under the other scheduler instead");
  }
  PLCHOST_TRY_ASSIGN(auto arrangement, arrange(scheduler, settings));
  {
    // Nothing but the tasks themselves may delay the exchange.
    const RaisedPriority raised(environment_.allow_unprivileged ? ThreadPriority{} : switch_priority(band_));
    const TimePoint from = clock_.now();
    if (!tick_by(*arrangement)) {
      ticker_.use(nullptr);
      retired_.push_back(std::move(arrangement));  // the ticker may take its plan until it has seen the next
      return failure(ErrorCode::timed_out, fmt::format("the event variable of {} does not return",
                                                       join_names(tasks_in_exception())));
    }
    retired_.push_back(std::exchange(active_, std::move(arrangement)));
    tick_ = active_->tick;
    watch(settings);
    distributed_clock_.set_steering(active_->scheduler->capabilities().one_shot);
    hand_out_sources();
    const TimePoint to = clock_.now();
    environment_.control_flight.put(to, FlightKind::switched, (to - from).count());
  }
  (void)wait_until_settled(MonotonicClock::now() + kSwitchPatience);
  return {};
}

// Waits for it. false: an event variable does not return; its task, and so all, are in exception.
bool TaskSet::ticker_follows() {
  while (!ticker_.settled(MonotonicClock::now() + kVariablePatience)) {
    const auto late = task_in_variable();
    if (!late) continue;
    raise_late_variable(*late);
    return false;
  }
  return true;
}

// The task whose event variable the ticker reads just now.
std::optional<std::size_t> TaskSet::task_in_variable() const noexcept {
  if (!poller_.trap().running_since()) return std::nullopt;
  const auto read =
      std::ranges::find(tasks_, poller_.trap().fault(), [](const auto& task) { return &task->fault(); });
  if (read == tasks_.end()) return std::nullopt;
  return static_cast<std::size_t>(read - tasks_.begin());
}

void TaskSet::raise_late_variable(std::size_t task) {
  TaskFault& fault = tasks_[task]->fault();
  if (!fault.claim(true)) return;
  fault.record().kind = FaultKind::task_watchdog;
  fault.record().in_event_variable = true;
  fault.record().figure = fault.record().limit = kVariablePatience.count();
  fault.publish();
}

}  // namespace plchost
