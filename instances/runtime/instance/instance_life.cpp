// How an Instance runs, stops, and fails its application: see application_state.hpp.

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include "instances/runtime/instance/instance.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/exception_history.hpp"

namespace plchost {

namespace {

constexpr auto kSoon = std::chrono::milliseconds(1);
// Log points, and the debugger's presence.
constexpr auto kDebugLook = std::chrono::milliseconds(20);
// A thread that waits between two cycles parks within this, on however busy a core.
constexpr auto kParkPatience = std::chrono::milliseconds(200);

long long in_ms(Duration duration) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
}

}  // namespace

ApplicationLife::Record Instance::recorder() {
  return [this](ApplicationState from, ApplicationState to, std::string_view reason) {
    const bool bad = to == ApplicationState::exception;
    spdlog::log(bad ? spdlog::level::err : spdlog::level::info, "application {} -> {}: {}", to_string(from),
                to_string(to), reason);
    if (transitions_) {
      transitions_->add(TransitionSource::application, std::to_underlying(from), std::to_underlying(to),
                        ::getpid(), reason);
    }
  };
}

Result<TaskSet::Prepared> Instance::prepare_start() {
  PLCHOST_TRY_ASSIGN(auto prepared, tasks_->prepare(scheduler_, start_.settings.scheduler));
  PLCHOST_TRY(host_->events().hold_bound());
  return prepared;
}

void Instance::start(TaskSet::Prepared prepared, std::string_view why) {
  host_->areas().outputs().arm();
  begin_debugging();  // the first cycle can halt
  tasks_->start(std::move(prepared));
  host_->events().publish_bound(true);
  unbound_.assign(application_->tasks().size(), false);
  life_.go_to(ApplicationState::running,
              fmt::format("{}: {} under {}", why, count_text(application_->tasks().size(), "task"),
                          tasks_->scheduler_name()));
}

Result<std::string> Instance::start_by_command() {
  PLCHOST_TRY_ASSIGN(auto prepared, prepare_start());
  start(std::move(prepared), "asked to start");
  return {};
}

// Once for each task: one whose fault has stopped only itself is asked to park, too, in a stop.
void Instance::unbind(std::size_t index) {
  const TaskConfig& task = application_->tasks()[index];
  if (!traits_of(task.kind).names_event || index >= unbound_.size() || unbound_[index]) return;
  unbound_[index] = true;
  host_->events().withdraw_task(task.external_event);
}

void Instance::begin_stop(std::string_view why) {
  let_tasks_go(why);
  (void)tasks_->begin_stop(start_.settings.stop);
  life_.go_to(ApplicationState::stopping, why);
}

Result<std::string> Instance::begin_single_cycle() {
  // A cycle that cannot begin changes neither outputs nor breakpoints.
  PLCHOST_TRY(tasks_->begin_single_cycle(start_.settings.scheduler, [this] {
    host_->areas().outputs().arm();
    begin_debugging();  // the first cycle can halt
  }));
  single_cycle_ends_ = MonotonicClock::now() + start_.settings.stop.others;
  life_.go_to(ApplicationState::single_cycle, "single cycle");
  return {};
}

bool Instance::in_transition() const noexcept {
  return life_.state() == ApplicationState::stopping || life_.state() == ApplicationState::single_cycle;
}

void Instance::advance() {
  advance_orders();
  if (change_) advance_change();
  advance_values();
  advance_debugger();
  if (!in_transition()) return;
  if (life_.state() == ApplicationState::single_cycle && !tasks_->stop_begun()) {
    const bool done = tasks_->single_cycle_done();
    // A task that a debugger halts does not use up the time.
    if (host_->debug().halted() > 0) single_cycle_ends_ = MonotonicClock::now() + start_.settings.stop.others;
    if (!done && MonotonicClock::now() < single_cycle_ends_) return;
    // Those that wait for their turn park at once; a task that does not is caught in its cycle.
    const Duration patience = done ? start_.settings.stop.others : Duration(kParkPatience);
    let_tasks_go("the single cycle is over");
    (void)tasks_->begin_stop({.outputs = patience, .others = patience});
  }
  if (const auto stuck = tasks_->advance_stop()) finish_transition(*stuck);
}

void Instance::finish_transition(const std::vector<std::size_t>& stuck) {
  if (stuck.empty()) {
    host_->areas().outputs().put_safe(PLC_IMAGE_STATE_STOPPED);
    const bool single = life_.state() == ApplicationState::single_cycle;
    const bool cut = single && !tasks_->left_out().empty();
    const std::string end = cut      ? cut_single_cycle()
                            : single ? "each task has run one cycle"
                                     : "all tasks are at the end of their cycles";
    life_.go_to(ApplicationState::stopped, end);
    host_->areas().save();
    beat();
    return cut ? answer_waiting(ErrorCode::timed_out, with_let_go(end))
               : answer_waiting(ErrorCode::ok, take_let_go());
  }
  std::vector<std::string> late;
  for (const std::size_t task : stuck) late.push_back(time_out(task));
  // Each is an exception of its own; the application's state names them all.
  KeptFaults kept;
  while (const auto fault = tasks_->take_fault()) kept.emplace_back(*fault, keep_fault(*fault));
  enter_exception(fmt::format("stop_timeout: not at the end of its cycle: task {}", fmt::join(late, ", ")));
  name_faults(kept);
}

std::string Instance::cut_single_cycle() const {
  return fmt::format("the single cycle was over after {} ms (Stop.OthersLimitMs) before the turn of {} {}",
                     in_ms(start_.settings.stop.others), tasks_->left_out().size() == 1 ? "task" : "tasks",
                     tasks_->names_of(tasks_->left_out()));
}

// "Main (after 200 ms)", "Edge (its event variable, after 200 ms)"
std::string Instance::time_out(std::size_t task) {
  const TaskConfig& config = tasks_->task(task).config();
  // The thread that reads event variables runs on until the second phase, whatever the task.
  const bool variable = tasks_->late_variable() == task;
  StopPhase phase = config.drives_outputs && !variable ? StopPhase::outputs : StopPhase::others;
  if (life_.state() == ApplicationState::single_cycle) phase = StopPhase::single_cycle;
  const Duration limit =
      phase == StopPhase::outputs ? start_.settings.stop.outputs : start_.settings.stop.others;
  raise_stop_timeout(tasks_->task(task).fault(), phase, limit, variable);
  return fmt::format("{} ({}after {} ms)", config.name, variable ? "its event variable, " : "", in_ms(limit));
}

void Instance::enter_exception(const std::string& reason) {
  host_->areas().outputs().put_safe(PLC_IMAGE_STATE_EXCEPTION);
  if (!life_.go_to(ApplicationState::exception, reason)) return;
  drop_change("the application that runs is in exception");
  let_tasks_go("the application is in exception");
  tasks_->park_all();
  host_->events().publish_bound(false);
  beat();
  answer_waiting(ErrorCode::timed_out, fmt::format("it is in exception now: {}; reset it to go on", reason));
}

void Instance::answer_waiting(ErrorCode code, const std::string& text) {
  if (!waiting_) return;
  const Waiting waiting = *std::exchange(waiting_, std::nullopt);
  spdlog::info("{}: {}", to_string(waiting.verb), code == ErrorCode::ok ? "done" : text);
  if (control_) control_->answer(waiting.asker, {.number = 0, .code = code, .text = text});
}

void Instance::begin_shutdown(std::string_view why) {
  if (std::exchange(shutdown_requested_, true)) {
    hurried_ = true;  // asked twice: the caller does not want to wait for cycles
    return;
  }
  drop_change(std::string(why));
  const ApplicationState state = life_.state();
  if (state == ApplicationState::running || state == ApplicationState::single_cycle) begin_stop(why);
  advance();
}

bool Instance::ended() const noexcept {
  return shutdown_requested_ && (hurried_ || !in_transition());
}

std::optional<Duration> Instance::wants_advance_in() const noexcept {
  const bool for_variables = !orders_.empty() || (values_ && values_->has_work());
  if (in_transition() || change_ || for_variables) return kSoon;
  if (has_debugger() && host_->debug().has_work()) return kDebugLook;
  return std::nullopt;
}

Result<void> Instance::shut_down() {
  is_down_ = true;
  drop_change("the process ends");
  drop_orders(ErrorCode::unavailable, "the process ends");
  log_ended_forces("the process ends");
  Result<void> stopped;
  bool settled = true;
  if (tasks_) {
    let_tasks_go("the process ends");
    tasks_->park_all();
    host_->events().publish_bound(false);
    const auto busy = tasks_->still_busy(MonotonicClock::now() + kParkPatience);
    settled = busy.empty();
    parked_ = tasks_->has_parked_thread();  // also one that a watchdog caught after its stop had timed out
    if (busy.empty()) {
      notify_tasks(EVT_PrepareExternalEventTaskDelete);
    } else {
      stopped =
          failure(ErrorCode::timed_out, fmt::format("still in its cycle: task {}", fmt::join(busy, ", ")));
    }
  }
  // Before its code is called once more: if that ends the process, nothing of ours is left behind.
  if (host_) host_->areas().end_outputs(settled);
  if (page_) {
    InstancePage::remove(options_.launch.pool, options_.launch.name);
    SymbolPage::remove(options_.launch.pool, options_.launch.name);
    DebugPage::remove(options_.launch.pool, options_.launch.name);
    FlightPage::remove(options_.launch.pool, options_.launch.name);
  }
  // Under a manager there will be a next process: the numbers go on, and it may need the settings.
  if (options_.launch.report_fd < 0) {
    // Of another process of that name, if the set-up of this one has ended before.
    if (transitions_) TransitionRing::remove(options_.launch.pool, options_.launch.name);
    if (control_) ::unlink(kept_settings_path(options_.launch.run_directory, options_.launch.name).c_str());
  }
  if (stopped) {
    // Its code may wait for what a thread that is parked in it holds.
    if (application_ && !parked_) application_->exit();
    if (host_) host_->end_refused();
    components_.exit();
    if (host_) host_->areas().finish();  // also what these two have changed
    // Only now: until then a thread of a component may have used a task's handle.
    if (host_) host_->task_table().attach(nullptr);
    losses_.reset();
    tasks_.reset();
    reference_.reset();
  }
  if (host_) {
    host_->write_messages();
    host_->events().withdraw_own();
  }
  control_.reset();
  values_.reset();
  return stopped;
}

}  // namespace plchost
