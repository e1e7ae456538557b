#include "manager/supervisor/managed_instance.hpp"

#include <chrono>
#include <csignal>
#include <utility>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/base/time.hpp"
#include "shm/base/transient.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/log/log.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

namespace {

InstancePlan plan_of(const InstanceConfig& config) {
  InstancePlan plan{.restart = config.restart,
                    .crash_limit = config.crash_limit,
                    .crash_window_ns = config.crash_window.count(),
                    .restart_delay_ns = config.restart_delay.count(),
                    .restart_delay_max_ns = config.restart_delay_max.count(),
                    .autostart = config.autostart ? 1U : 0U,
                    .share_core = config.share_core ? 1U : 0U,
                    .priority_band = FixedText<15>(config.priority_band),
                    .settings = FixedText<kMaxPath>(config.settings),
                    .application = FixedText<kMaxPath>(config.application),
                    .after = {}};
  plan.after.assign(fmt::format("{}", fmt::join(config.after, ",")));
  return plan;
}

}  // namespace

ManagedInstance::ManagedInstance(const InstanceConfig& config, const Surroundings& surroundings, Own own)
    : config_(config),
      surroundings_(surroundings),
      own_(std::move(own)),
      host_(own_.host),
      scheduler_(config.scheduler),
      begun_with_(configured()) {
  unix_offset_ns_ = unix_time_ns() - surroundings_.now().time_since_epoch().count();
  restore();
  status_.name.assign(config.name);
  status_.scheduler.assign(scheduler_);
  status_.application.assign(application_);
  status_.plan = plan_of(config_);
}

void ManagedInstance::hold(const std::string& why) {
  if (phase_ == Phase::held && status_.problem.view() == why) return;
  set_state(Phase::held, InstanceState::waiting, why);
}

void ManagedInstance::release() {
  if (phase_ == Phase::held) spawn(wants_running_ ? Next::run : Next::stay_stopped);
}

void ManagedInstance::shut_down() {
  shutting_down_ = true;
  next_ = Next::nothing;
  end_orders(ErrorCode::unavailable, "the manager is shutting down");
  if (operation_) finish(ErrorCode::unavailable, "the manager is shutting down");
  carry_out(decided({.cause = EndCause::manager_ends}), "");
}

void ManagedInstance::on_report(const SetupReport& report) {
  if (phase_ != Phase::setting_up) return;
  if (report.code != ErrorCode::ok) {
    setup_failure_ = fmt::format("{}: {}", to_string(report.step), report.text);
    name_taken_ = report.code == ErrorCode::already_exists;
    transient_ = report.transient;
    limit_met_ = report.transient && host_.has_met_pids_max();
    if (limit_met_) setup_failure_ += "; it needs more threads and processes than its pids_max";
    declaration_taken_ = report.code == ErrorCode::busy;
    return;  // the process ends by itself now, or the timer sees to it
  }
  if (!report.text.empty()) {
    spdlog::info("instance {}: {}: {}", config_.name, to_string(report.step), report.text);
  }
  if (report.step != SetupStep::ready) {
    step_ = static_cast<SetupStep>(std::to_underlying(report.step) + 1);
    return;
  }
  come_up();
}

void ManagedInstance::on_reply(const ControlReply& reply) {
  if (operation_ && operation_->step == Step::forwarded && reply.number == operation_->forwarded_number) {
    finish_forwarded(reply);
  } else if (ends_order(reply)) {
    settled_ = surroundings_.now();
  } else if (phase_ == Phase::adopting) {
    const bool awaited = reply.number == asked_number_;
    if (hear(reply) || awaited) finish_adoption("");
  } else {
    (void)hear(reply);  // or an answer that came too late
  }
}

void ManagedInstance::come_up() {
  host_.set_timer(std::nullopt);
  starvation_.forget();
  starved_by_.clear();
  up_since_ = settled_ = sign_at_ = surroundings_.now();
  start_kind_ = StartKind::warm;
  before_.reset();
  // An adopted one may be in its set-up still, in which it answers to nobody.
  if (phase_ == Phase::setting_up) heard_of_ = true;
  if (history_.safe_mode) {
    set_state(Phase::up, InstanceState::safe_mode, problem_when_up());
  } else {
    const bool runs = begins_running_ && !application_.empty();
    set_state(Phase::up, runs ? InstanceState::running : InstanceState::stopped, problem_when_up());
  }
  if (!log_level_.empty()) use_log_level();
  if (!operation_) return;
  if (operation_->step == Step::fresh_process && !operation_->refused.empty()) {
    finish(ErrorCode::unavailable, fmt::format("{}; {}, which was loaded before, is started again",
                                               operation_->refused, application_));
  } else if (operation_->step == Step::fresh_process) {
    finish(ErrorCode::ok, application_.empty() ? "it is up without an application: load one" : loaded_text());
  } else if (operation_->step == Step::until_up) {
    forward_or_wait();
  }
}

std::string ManagedInstance::problem_when_up() {
  std::string problem = core_problem();
  if (removed_) problem = "removed from the configuration: it runs until it is stopped";
  const auto add = [&](const std::string& text) { problem += (problem.empty() ? "" : "; ") + text; };
  if (history_.safe_mode) {
    add(fmt::format("safe mode after {} within {} s, the last: {}; load an application, or reset it",
                    count_text(config_.crash_limit, "crash", "crashes"),
                    std::chrono::ceil<std::chrono::seconds>(config_.crash_window).count(),
                    last_end_.empty() ? "unknown" : last_end_));
  } else if (application_.empty()) {
    add("no application; load one");
  } else if (!last_end_.empty()) {
    add("ended last: " + last_end_);
  }
  if (!taken_back_.empty() && !history_.safe_mode) {
    add(fmt::format("{}; this one, which was loaded before, runs with the settings of then", taken_back_));
  }
  if (const std::string changes = awaited_changes(); !changes.empty()) add(changes);
  if (!starved_by_.empty()) add(starved_by_);
  if (page_damaged_) {
    add("another program has damaged its status page: figures of its tasks are missing or old; restart it");
  }
  return problem;
}

void ManagedInstance::on_timer() {
  switch (phase_) {
    case Phase::backing_off:
      if (awaited_) return look_for_process();
      if (name_taken_ && adopt()) return;
      ++status_.restarts;
      return spawn(wants_running_ ? Next::run : Next::stay_stopped);
    case Phase::setting_up:
      return set_up_timed_out();
    case Phase::adopting:
      return adoption_timed_out();
    case Phase::up:
      if (operation_ && operation_->step == Step::forwarded) {
        fail(ErrorCode::timed_out,
             no_answer_text(takes_over() ? ControlVerb::change_application : operation_->request.verb));
      }
      return;
    case Phase::ending:
      if (ending_ == Ending::asked) {
        ending_ = Ending::terminated;
        host_.signal(SIGTERM);
        host_.set_timer(after(kTerminateLimit));
      } else {
        ending_ = Ending::killed;
        spdlog::warn("instance {}: does not end; it is killed", config_.name);
        host_.signal(SIGKILL);
      }
      return;
    case Phase::down:
    case Phase::held:
      return;
  }
}

void ManagedInstance::set_up_failed(const std::string& why) {
  if (setup_failure_.empty()) setup_failure_ = why;
  host_.set_timer(std::nullopt);
  host_.signal(SIGKILL);
}

void ManagedInstance::fresh_process(Next next, StartKind kind) {
  commanded_ = wish_known_ = true;
  unreadable_.clear();
  taken_back_.clear();
  if (next == Next::stay_stopped) wants_running_ = false;
  // The first process is the first one, however it was asked for.
  if (start_kind_ != StartKind::first || kind == StartKind::cold) start_kind_ = kind;
  const Decision decision =
      decided({.cause = EndCause::replaced, .order = next == Next::run ? Order::run : Order::stop});
  last_end_.clear();
  operation_->step = Step::fresh_process;
  if (idle_phase()) {
    carry_out(decision, "");
  } else {
    end_process(next);
  }
}

LaunchOptions ManagedInstance::launch_options(Next next) const {
  LaunchOptions options;
  options.name = config_.name;
  options.cores = {config_.core};
  options.scheduler = scheduler_;
  options.priority_band = config_.priority_band;
  options.settings = config_.settings;
  options.kept_settings = !taken_back_.empty();
  options.application = history_.safe_mode ? "" : application_;
  options.pool = surroundings_.host.pool;
  options.run_directory = surroundings_.host.run_directory;
  options.state_directory = surroundings_.host.state_directory;
  options.start_kind = start_kind_;
  options.user = surroundings_.host.instance_user;
  options.trusted_users = users_of_instances();
  options.no_debug = !surroundings_.host.allow_debug;
  options.stopped = next == Next::stay_stopped;
  options.report_fd = kChildReportFd;
  options.log_level = surroundings_.host.log_level;
  return options;
}

void ManagedInstance::spawn(Next next) {
  (void)use_configuration();
  wants_running_ = begins_running_ = next == Next::run;
  wish_known_ = true;
  setup_failure_.clear();
  said_scheduler_.clear();
  awaited_.reset();
  name_taken_ = transient_ = declaration_taken_ = limit_met_ = false;
  const auto pid = host_.spawn(launch_options(next));
  if (!pid) {
    transient_ = is_transient(pid.error());
    return ended({.cause = cause_of_refusal()}, pid.error().describe());
  }
  status_.pid = *pid;
  log_level_ = surroundings_.host.log_level;
  forget_signs();
  set_up_limit_ = WorkLimit(kSetupLimit, surroundings_.now());
  host_.set_timer(after(kSetupLimit));
  set_state(Phase::setting_up, InstanceState::starting, last_end_.empty() ? "" : "ended last: " + last_end_);
}

void ManagedInstance::end_process(Next next) {
  if (operation_) ended_forces_ = forces_of_process();
  next_ = next;
  ending_ = Ending::asked;
  if (!silent_ && send(ControlVerb::shutdown)) {
    host_.set_timer(after(kShutdownLimit));
  } else {
    ending_ = Ending::terminated;
    host_.signal(SIGTERM);
    host_.set_timer(after(kTerminateLimit));
  }
  set_state(Phase::ending, InstanceState::stopping, "");
}

void ManagedInstance::go_down(InstanceState state, const std::string& problem) {
  host_.set_timer(std::nullopt);
  set_state(Phase::down, state, problem);
}

// Nothing of its application is being done.
bool ManagedInstance::rests() const noexcept {
  if (phase_ == Phase::held || phase_ == Phase::backing_off) return true;
  return phase_ == Phase::up &&
         (status_.state == InstanceState::stopped || status_.state == InstanceState::safe_mode);
}

void ManagedInstance::refresh() {
  end_late_orders();
  if (!operation_ && !shutting_down_ && rests()) {
    const Decision decision = decided({.cause = EndCause::idle, .order = order()});
    carry_out(decision, last_end_);
    if (decision.action != Decision::Action::leave) return;
  }
  if (phase_ == Phase::setting_up) watch_set_up();
  if (phase_ == Phase::adopting) watch_adoption();
  if (phase_ != Phase::up) return;
  const auto runtime = watch_process();
  if (!runtime || operation_ || silent_) return;
  // There is no way out of an exception, so this is never too early to be believed.
  const bool excepted = runtime->state == ApplicationState::exception;
  if (excepted && status_.state != InstanceState::exception) return show_application(*runtime);
  if (surroundings_.now() - settled_ < kPageLag) return;
  const bool same_names = history_.safe_mode || runtime->application.view() == status_.application.view();
  const bool same_state = history_.safe_mode || status_.state == shown_state(*runtime);
  if (same_state && same_names && runtime->scheduler.view() == status_.scheduler.view()) return;
  learn_scheduler(runtime->scheduler.view());
  if (!history_.safe_mode) application_ = runtime->application.view();
  if (same_state) return publish();
  show_application(*runtime);
}

// The application's state, as the world is told of its instance.
InstanceState ManagedInstance::shown_state(const InstanceRuntime& runtime) noexcept {
  switch (runtime.state) {
    case ApplicationState::running:
    case ApplicationState::single_cycle:
      return InstanceState::running;
    case ApplicationState::stopping:
      return InstanceState::stopping;
    case ApplicationState::exception:
      return InstanceState::exception;
    case ApplicationState::none:
    case ApplicationState::stopped:
      break;
  }
  return InstanceState::stopped;
}

void ManagedInstance::show_application(const InstanceRuntime& runtime) {
  if (history_.safe_mode) return;
  const InstanceState state = shown_state(runtime);
  if (state == InstanceState::exception) {
    set_state(Phase::up, state, std::string(runtime.problem.view()));
    return carry_out(decided({.cause = EndCause::exception, .order = order()}),
                     std::string(runtime.problem.view()));
  }
  const bool unwanted = state == InstanceState::stopped && wants_running_;
  set_state(Phase::up, state,
            unwanted ? "the application stopped by itself: see its tasks" : problem_when_up());
}

std::string ManagedInstance::core_problem() {
  const auto cores = host_.granted_cores();
  status_.core = cores.size() == 1 ? cores.front() : -1;
  if (cores == std::vector<int>{config_.core}) return "";
  return fmt::format("may run on cores {} where {} is configured; restart it to move it",
                     fmt::join(cores, ", "), config_.core);
}

std::string ManagedInstance::no_answer_text(ControlVerb verb) const {
  return fmt::format("'{}' did not answer within {} s{}{}", config_.name,
                     std::chrono::duration_cast<std::chrono::seconds>(operation_of(verb).limit).count(),
                     starved_by_.empty() ? "" : ": ", starved_by_);
}

Result<std::uint64_t> ManagedInstance::send_limited(ControlVerb verb, const ControlRequest& request) {
  const std::int64_t ours = boot_time_ns() + operation_of(verb).limit.count();
  return send(verb, request.argument, request.limit_ns == 0 ? ours : std::min(ours, request.limit_ns));
}

Result<std::uint64_t> ManagedInstance::send(ControlVerb verb, const std::string& argument,
                                            std::int64_t limit_ns) {
  const std::uint64_t number = next_number_++;
  PLCHOST_TRY(host_.request(ControlRequest{
      .number = number, .verb = verb, .instance = config_.name, .argument = argument, .limit_ns = limit_ns}));
  return number;
}

void ManagedInstance::set_state(Phase phase, InstanceState state, const std::string& problem) {
  const InstanceState before = status_.state;
  const Phase from = std::exchange(phase_, phase);
  const bool was_up = from == Phase::up;
  if (state != before) status_.state_since_unix_ns = unix_time_ns();
  status_.state = state;
  status_.problem.assign(problem);
  surroundings_.observer.stepped(status_, from, phase);
  const bool bad = state == InstanceState::failed || state == InstanceState::safe_mode ||
                   state == InstanceState::exception;
  spdlog::log(bad ? spdlog::level::warn : spdlog::level::info, "instance {}: {}{}{}", config_.name,
              to_string(state), problem.empty() ? "" : ": ", problem);
  const bool of_process = !was_up || phase != Phase::up || silent_;
  if (state != before && of_process) surroundings_.observer.transition(status_, before, state, problem);
  publish();
}

// A process's first report, before any command, has the values of its settings: the next process reads them
// anew.
void ManagedInstance::learn_scheduler(std::string_view name) {
  if (name.empty() || name == said_scheduler_) return;
  if (!scheduler_.empty() || !said_scheduler_.empty()) scheduler_ = name;
  said_scheduler_ = name;
}

void ManagedInstance::publish() {
  status_.scheduler.assign(scheduler_.empty() ? said_scheduler_ : scheduler_);
  status_.application.assign(application_);
  status_.plan = plan_of(config_);
  remember();
  surroundings_.observer.changed(own_.place, status_);
  own_.changed();
}

}  // namespace plchost
