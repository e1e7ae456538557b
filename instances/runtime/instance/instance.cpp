#include "instances/runtime/instance/instance.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "instances/runtime/application/declare_application.hpp"
#include "instances/runtime/setup/own_user.hpp"
#include "instances/runtime/setup/sandbox.hpp"
#include "instances/runtime/setup/set_up_watch.hpp"
#include "instances/runtime/tasks/registered_events.hpp"
#include "instances/runtime/tasks/task_builder.hpp"
#include "schedulers/supervision/watchdog_rules.hpp"
#include "shm/base/names.hpp"
#include "shm/base/transient.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/outputs_page.hpp"
#include "shm/plc_process_image.h"

namespace plchost {

namespace {

constexpr auto kTellAgain = std::chrono::seconds(10);

// As many as anybody reads: the file is a stranger's.
void log_what_is_left_alone(const InstanceSettings& settings) {
  if (!settings.foreign_sections.empty()) {
    spdlog::info("settings: sections of other programs, left alone: {}",
                 join_some(settings.foreign_sections));
  }
  if (!settings.foreign_components.empty()) {
    spdlog::info("settings: components of other programs, left alone: {}",
                 join_some(settings.foreign_components));
  }
  constexpr std::size_t kMost = 50;
  const auto& remarks = settings.remarks;
  for (std::size_t i = 0; i < std::min(remarks.size(), kMost); ++i) spdlog::warn("settings: {}", remarks[i]);
  if (remarks.size() > kMost) spdlog::warn("settings: {} more remarks", remarks.size() - kMost);
}

}  // namespace

std::unique_ptr<Instance> Instance::set_up(const Options& options, SetupReporter& reporter) {
  struct Step {
    SetupStep step;
    Result<std::string> (Instance::*take)();
  };
  // The tasks' statistics lie in the status page, so it is made before their threads.
  constexpr std::array kSteps = {
      Step{SetupStep::bind_core, &Instance::bind_core},
      Step{SetupStep::lock_memory, &Instance::lock_memory},
      Step{SetupStep::read_settings, &Instance::read_settings_file},
      Step{SetupStep::attach_pool, &Instance::attach_pool},
      Step{SetupStep::open_control_socket, &Instance::open_control_socket},
      Step{SetupStep::load_components, &Instance::load_components},
      Step{SetupStep::load_application, &Instance::load_application},
      Step{SetupStep::make_status_page, &Instance::make_status_page},
      Step{SetupStep::make_tasks, &Instance::make_tasks},
      Step{SetupStep::start_scheduler, &Instance::start_scheduler},
  };
  std::unique_ptr<Instance> instance(new Instance(options));
  for (const Step& step : kSteps) {
    auto remark = instance->take_watched(step.step, reporter, step.take);
    if (!remark) {
      reporter.failed(step.step, remark.error());
      (void)instance->shut_down();
      return nullptr;
    }
    reporter.done(step.step, *remark);
  }
  instance->beat();
  reporter.done(SetupStep::ready);
  // Not before: the tasks run, and one that aborts with the lock of the heap holds up what allocates.
  instance->keep_settings();
  return instance;
}

// Code of components and of the application runs in these two steps.
Result<std::string> Instance::take_watched(SetupStep step, SetupReporter& reporter,
                                           Result<std::string> (Instance::*take)()) {
  if (step != SetupStep::load_components && step != SetupStep::load_application) return (this->*take)();
  const Duration guard = start_.settings.scheduler.watchdog.default_time;
  SetUpWatch watch(guard, SetUpWatch::kAboveAll, [&](const Error& error) {
    reporter.failed(step, error);
    (void)std::fflush(nullptr);
    ::_exit(kExitSetupFailed);  // the thread that sets up may hold any lock
  });
  auto remark = (this->*take)();
  if (auto ended = watch.end(); !ended && remark) return std::unexpected(std::move(ended).error());
  return remark;
}

Instance::~Instance() {
  if (!is_down_) (void)shut_down();
}

Result<std::string> Instance::bind_core() {
  PLCHOST_TRY_ASSIGN(cores_, bind_to_cores(options_.launch.cores));
  return {};
}

Result<std::string> Instance::lock_memory() {
  real_time_ = set_up_real_time();
  return real_time_.remark;
}

Result<std::string> Instance::read_settings_file() {
  PLCHOST_TRY_ASSIGN(start_, read_start_settings(options_.launch));
  log_what_is_left_alone(start_.settings);
  choose_scheduler();
  std::string remark = hold_idle_states();
  PLCHOST_TRY(become_own_user());
  return remark;
}

// After the files that are root's, and before any code of an application.
Result<void> Instance::become_own_user() {
  if (options_.launch.user.empty()) return {};
  auto become = become_user_of_instances(options_.launch.user, options_.launch.pool);
  if (!become) return failure_in("[host] instance_user", std::move(become).error());
  spdlog::info("{}", *become);
  return {};
}

// Needs the settings, and the cores that bind_core() has got.
std::string Instance::hold_idle_states() {
  idle_hold_ = IdleHold::take(start_.settings.idle_states, cores_, options_.launch.run_directory, {});
  return idle_hold_.as_wanted() ? std::string() : fmt::format("idle states: {}", idle_hold_.status());
}

void Instance::choose_scheduler() {
  const std::string asked = std::exchange(scheduler_, scheduler_for(scheduler_, start_.settings));
  const std::string_view of_settings = scheduler_of(TimerMode::one_shot);
  if (asked.empty() || start_.settings.timer_mode != TimerMode::one_shot || scheduler_ == of_settings) return;
  spdlog::warn("settings: TimerMode=OneShot asks for {}, but {} was asked for at the start and is used",
               of_settings, scheduler_);
}

Result<std::string> Instance::attach_pool() {
  PLCHOST_TRY_ASSIGN(name_claim_, claim_name(options_.launch));
  // Of a process before this one that was killed while there was no manager.
  end_outputs(options_.launch.pool, options_.launch.name);
  // Of a manager's instance the manager has made sure whose the pool is, and its owner can be a third user.
  const bool managed = options_.launch.report_fd >= 0;
  auto pool = managed ? ObjectPool::attach(options_.launch.pool) : ObjectPool::create(options_.launch.pool);
  if (!pool && managed && pool.error().code == ErrorCode::not_found) {
    pool = ObjectPool::create(options_.launch.pool);
  }
  PLCHOST_TRY_ASSIGN(pool_, std::move(pool));
  host_.emplace(options_.launch.name, &*pool_);
  host_->set_start_kind(static_cast<int>(options_.launch.start_kind));
  PLCHOST_TRY(in_step("events of the process before", host_->events().clear_left_behind()));
  PLCHOST_TRY(prepare_host(start_, *host_));
  return {};
}

Result<std::string> Instance::open_control_socket() {
  if (options_.launch.run_directory.empty()) return {};
  PLCHOST_TRY_ASSIGN(
      auto server,
      InstanceSocket::listen(instance_socket_path(options_.launch.run_directory, options_.launch.name),
                             [this](const ControlRequest& request, const InstanceSocket::Asker& asker) {
                               return handle(request, asker);
                             }));
  control_.emplace(std::move(server));
  PLCHOST_TRY_ASSIGN(auto values, ValueServer::listen(
                                      values_socket_path(options_.launch.run_directory, options_.launch.name),
                                      host_->variables()));
  values_.emplace(std::move(values));
  PLCHOST_TRY(restore_operator_events());
  return {};
}

// For the start that follows one that fails under other settings.
void Instance::keep_settings() {
  const LaunchOptions& launch = options_.launch;
  if (launch.run_directory.empty()) return;
  const std::string path = kept_settings_path(launch.run_directory, launch.name);
  const auto kept = plchost::keep_settings(path, start_.file, start_.texts);
  if (kept) return;
  // An earlier process's are other settings than those of the application that runs.
  ::unlink(path.c_str());
  spdlog::warn("its settings are not kept: {}", kept.error().describe());
}

// The next registration writes down those that are registered then, so none may be left out for a moment's
// shortage.
Result<void> Instance::restore_operator_events() {
  const std::string path = operator_events_path(options_.launch.run_directory, options_.launch.name);
  const auto events = read_operator_events(path);
  if (!events && is_transient(events.error())) return failure_in("events of the operator", events.error());
  if (!events) spdlog::warn("events of the operator: {}", events.error().describe());
  for (const std::string& event : events.value_or(std::vector<std::string>())) {
    auto done = host_->events().register_by_operator(event);
    if (!done && is_transient(done.error()))
      return failure_in("event of the operator", std::move(done).error());
    if (!done) spdlog::warn("event '{}' of the operator: {}", event, done.error().describe());
  }
  return {};
}

Result<std::string> Instance::load_components() {
  constexpr std::array<PF_SYSTIME, 2> kOwnTime = {SysTimeGetUs, SysTimeGetNs};
  PLCHOST_TRY(plchost::load_components(start_.settings, ComponentHooks::init, components_, *host_, kOwnTime));
  return {};
}

LoadContext Instance::load_context() {
  return {.launch = options_.launch, .start = start_, .host = *host_, .pool = &*pool_};
}

Result<std::string> Instance::load_application() {
  PLCHOST_TRY_ASSIGN(const Confinement confinement, confine_to_load(start_.settings.seccomp));
  if (!confinement.holds.empty()) spdlog::info("{}", confinement.holds);
  PLCHOST_TRY_ASSIGN(const std::string remark, load_confined());
  const bool both = !confinement.remark.empty() && !remark.empty();
  return confinement.remark + (both ? "; " : "") + remark;
}

Result<std::string> Instance::load_confined() {
  if (options_.launch.application.empty()) return "no application is given: there is nothing to run";
  const LoadContext context = load_context();
  PLCHOST_TRY_ASSIGN(auto declared, declare_application(options_.launch.application, context));
  application_.emplace(std::move(declared.application));
  scheduler_ = scheduler_for(options_.launch.scheduler, start_.settings, declared.declaration.scheduler);
  PLCHOST_TRY_ASSIGN(auto commit, Commit::prepare(context, *application_, std::move(declared.declaration)));
  commit.hold([](const void*) { return false; });
  return commit.remark();
}

Result<std::string> Instance::make_status_page() {
  std::vector<TaskIdentity> identities;
  if (application_) {
    for (const TaskConfig& task : application_->tasks()) identities.push_back(identity_of(task));
  }
  PLCHOST_TRY_ASSIGN(auto page, InstancePage::create(options_.launch.pool, options_.launch.name, identities,
                                                     start_.settings.fine_tasks));
  page_.emplace(std::move(page));
  PLCHOST_TRY(host_->variables().publish(options_.launch.pool, options_.launch.name));
  PLCHOST_TRY_ASSIGN(auto transitions, TransitionRing::open(options_.launch.pool, options_.launch.name));
  transitions_.emplace(std::move(transitions));
  make_flight_recorder();
  return {};
}

// Without it, as with a full /dev/shm, the tasks run all the same.
void Instance::make_flight_recorder() {
  const LaunchOptions& launch = options_.launch;
  FlightPage::remove(launch.pool, launch.name);  // of a process before
  if (!application_) return;
  std::vector<FlightTask> tasks;
  for (const TaskConfig& task : application_->tasks()) {
    FlightTask told{.name = {}, .iec_priority = task.iec_priority};
    told.name.assign(task.name);
    const std::string& event = task.external_event;
    if (!event.empty()) {
      told.event_mark = event_mark(event.contains('/') ? event : event_object_name(launch.name, event));
    }
    tasks.push_back(told);
  }
  auto page = FlightPage::create(launch.pool, launch.name, tasks);
  if (page) {
    flight_.emplace(std::move(*page));
  } else {
    spdlog::warn("there is no flight recorder, so no cause of lost cycles is told: {}",
                 page.error().describe());
  }
}

FlightRing Instance::flight_ring(std::size_t number) {
  return flight_ ? flight_->ring(number) : FlightRing();
}

Result<std::string> Instance::make_tasks() {
  DebugPage::remove(options_.launch.pool, options_.launch.name);  // of a process before
  if (!application_) return {};
  TaskEnvironment environment{
      .find_event = [this](std::string_view event) { return host_->events().bind_task(event); },
      .statistics = [this](std::size_t index) -> TaskStatistics& {
        return page_->statistics(static_cast<std::uint32_t>(index));
      },
      .fault_record = [this](std::size_t index) -> Seqlock<FaultRecord>& {
        return page_->task(static_cast<std::uint32_t>(index)).fault;
      },
      .state_changed =
          [this](std::size_t index, bool running) {
            if (!running) host_->areas().outputs().task_rests(index);
            const auto state = running ? PageTaskState::running : PageTaskState::stopped;
            const auto task = static_cast<std::uint32_t>(index);
            // A task that comes back too late has been in exception all the same.
            if (page_->task_state(task) != PageTaskState::exception) page_->set_task_state(task, state);
          },
      // Not before: in the first phase of a stop the others run what is posted. Nor later: a task in its last
      // cycle does not.
      .to_park = [this](std::size_t index) { unbind(index); },
      .halted = [this] { host_->areas().outputs().fail(); },
      .flight = [this](std::size_t index) { return flight_ring(kFirstTaskRing + index); },
      .control_flight = flight_ring(kControlRing),
      .watch_flight = flight_ring(kWatchRing),
      .poll_flight = flight_ring(kPollRing),
      .catch_faults = true,
  };
  PLCHOST_TRY_ASSIGN(tasks_,
                     TaskSet::create(clock_, options_.band, application_->tasks(), std::move(environment)));
  if (flight_) losses_.emplace(*flight_, *tasks_, cores_.size() == 1);
  host_->task_table().attach(tasks_.get());
  PLCHOST_TRY(attach_debugger());
  reference_ = follow_reference(tasks_->distributed_clock(), start_.settings.scheduler.distributed_clock,
                                options_.launch.pool);
  notify_tasks(EVT_ExternalEventTaskCreateDone);
  host_->notify(EVT_PrepareStart, {});
  for (const std::string& line :
       describe_cycle_limits(application_->tasks(), start_.settings.scheduler.watchdog)) {
    spdlog::info("watchdog: {}", line);
  }
  life_.go_to(ApplicationState::stopped, fmt::format("{} is loaded ({} start)", application_->name(),
                                                     to_string(options_.launch.start_kind)));
  return {};
}

Result<std::string> Instance::start_scheduler() {
  PLCHOST_TRY_ASSIGN(const Confinement confinement, confine_to_start(start_.settings.seccomp));
  if (!confinement.holds.empty()) spdlog::info("{}", confinement.holds);
  std::optional<TaskSet::Prepared> prepared;
  if (tasks_ && !options_.launch.stopped) {
    PLCHOST_TRY_ASSIGN(prepared, prepare_start());
  }
  // A start that has failed until here leaves the memories of the pool and the retain values as they were.
  // Nothing fails behind it. Not later: a task that aborts with the lock of the heap would hold it up.
  PLCHOST_TRY(host_->areas().keep());
  if (prepared) start(*std::move(prepared), "start of the process");
  return {};
}

void Instance::notify_tasks(unsigned event) {
  for (std::size_t i = 0; i < application_->tasks().size(); ++i) {
    const TaskConfig& task = application_->tasks()[i];
    if (!traits_of(task.kind).names_event) continue;
    if (const auto handle = host_->events().open(task.external_event)) {
      host_->notify(event, {.pTaskInfo = &application_->info(i), .hEvent = *handle});
    }
  }
}

void Instance::report_tick() {
  if (!tasks_) return;
  TickReport now = tasks_->tick_report();
  if (!now.fallback.empty() && now.fallback != tick_.fallback) {
    spdlog::error("tick source: {}; the system's clock ticks instead", now.fallback);
  }
  tick_ = std::move(now);
}

// A clock that cannot be read is told by its Reference, which knows more.
void Instance::report_clock(ClockRuntime& clock) {
  if (reference_ && !reference_->problem().empty()) clock.problem.assign(reference_->problem());
  const std::string_view silence =
      reference_ && reference_->problem().empty() ? clock.problem.view() : std::string_view();
  if (silence == clock_silence_) return;
  // Once for each silence, whatever its reasons are.
  if (!silence.empty() && clock_silence_.empty()) spdlog::warn("{}; the grids go on without it", silence);
  if (silence.empty() && clock.state != 0 && clock.problem.view().empty())
    spdlog::info("the reference clock is followed again");
  clock_silence_ = silence;
}

static_assert(PLC_IMAGE_SIGN_NS == Duration(Instance::kHeartbeat).count());

void Instance::beat() {
  // First: the rest may wait for a lock of the heap, which a task that was caught can hold.
  host_->areas().outputs().beat([this](std::size_t index) {
    const Task& task = tasks_->task(index);
    return task.in_cycle() && !task.trap().parked();
  });
  for (const std::string& news : host_->areas().watch_inputs()) spdlog::warn("{}", news);
  host_->write_messages();
  if (control_) control_->beat();
  if (values_) values_->beat();
  report_tick();
  if (life_.state() == ApplicationState::exception) (void)tasks_->still_busy(TimePoint{});
  if (losses_) losses_->look(MonotonicClock::now());
  if (tasks_) tasks_->look_after_posts();
  if (tasks_) {
    for (const std::string& news : tasks_->look_after_processor()) spdlog::warn("{}", news);
  }
  host_->events().refresh();
  if (reference_) reference_->refresh();
  InstanceRuntime runtime;
  runtime.pid = ::getpid();
  runtime.core = cores_.size() == 1 ? cores_.front() : -1;
  runtime.running = life_.state() == ApplicationState::running ? 1 : 0;
  runtime.state = life_.state();
  runtime.problem.assign(life_.problem());
  runtime.memory_locked = real_time_.memory_locked ? 1 : 0;
  runtime.heartbeat_ns = MonotonicClock::now().time_since_epoch().count();
  runtime.scheduler.assign(scheduler_);
  runtime.idle_states.assign(idle_hold_.status());
  runtime.tick_source.assign(tick_.source);
  runtime.tick_fallback.assign(tick_.fallback);
  if (application_) runtime.application.assign(application_->path());
  if (tasks_ && tasks_->running()) runtime.clock = clock_runtime(tasks_->distributed_clock());
  runtime.clock.reference.assign(start_.settings.scheduler.distributed_clock.reference);
  report_clock(runtime.clock);
  runtime.variables = static_cast<std::uint32_t>(host_->variables().count());
  runtime.forces = static_cast<std::uint32_t>(host_->variables().forces().size());
  runtime.retain_problem.assign(host_->areas().retain_problem());
  page_->write_runtime(runtime);
  look_after_page();
  for (const std::string& loss : host_->areas().look_for_losses()) spdlog::warn("{}", loss);
}

// The manager hears of state and heartbeat over the control socket as long as the page cannot tell them.
void Instance::look_after_page() {
  if (flight_) flight_->keep();
  if (page_->lost()) {
    if (std::exchange(page_lost_told_, true)) return;
    spdlog::warn(
        "the page of this instance was cut short by another program: its figures are not shown any more "
        "until it is started again");
    return;
  }
  const bool written_over = page_->keep([this](std::uint32_t index) {
    if (!tasks_) return KnownFault{};
    const TaskFault& fault = tasks_->task(index).fault();
    return KnownFault{.raised = fault.raised(), .record = fault.published()};
  });
  if (!written_over) return;
  const TimePoint now = MonotonicClock::now();
  ++page_damages_;
  if (page_damages_ > 1 && now < page_told_ + kTellAgain) return;
  page_told_ = now;
  spdlog::warn(
      "the page of this instance was written over by another program ({} so far) and is written anew; "
      "statistics of tasks may be wrong: reset them",
      count_text(page_damages_, "time"));
}

}  // namespace plchost
