// The wish of a ManagedInstance, beyond the end of the manager: see the rules in managed_instance.hpp.

#include <algorithm>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "manager/supervisor/managed_instance.hpp"
#include "shm/base/time.hpp"
#include "shm/log/log.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

namespace {

// Without limits as versions before had it. The settings, a path, are last.
std::string configured_process(const InstanceConfig& config) {
  std::string text = fmt::format("{} {} ", config.core, config.priority_band);
  if (config.memory_max_mib != 0) text += fmt::format("memory={} ", config.memory_max_mib);
  if (config.pids_max != 0) text += fmt::format("pids={} ", config.pids_max);
  if (config.oom_score != kInstanceOomScore) text += fmt::format("oom={} ", config.oom_score);
  return (text + config.settings).substr(0, kMaxWishText);
}

}  // namespace

void ManagedInstance::restore() {
  auto found = own_.wishes.find();
  // Afterwards: a disk that was slow to answer has answered then.
  const std::string boot = own_.applications.boot();
  application_ = boot.empty() ? config_.application : boot;
  if (!found) {
    unreadable_ = found.error().describe();
    spdlog::error("instance {}: its wanted state is not known, so it is not started: {}", config_.name,
                  unreadable_);
    return;
  }
  earlier_ = *std::move(found);
  if (!earlier_) return;
  wish_known_ = true;
  const InstanceWish& earlier = *earlier_;
  begun_with_ = {.application = earlier.configured_application,
                 .scheduler = earlier.configured_scheduler,
                 .process = earlier.configured_process};
  scheduler_ = earlier.scheduler;
  const bool boots = earlier.host_ended && !boot.empty();
  if (!boots) application_ = earlier.application;
  commanded_ = earlier.commanded;
  wants_running_ = earlier.commanded ? earlier.running : true;
  if (!earlier.host_ended || earlier.safe_mode) last_end_ = earlier.last_end;
  if (!boots && !earlier.application_before.empty()) before_ = earlier.application_before;
  // The run directory, where the settings of then are, may be empty after a power cut.
  if (!earlier.host_ended) taken_back_ = earlier.taken_back;
  status_.restarts = earlier.restarts;
  // An instance that begins with the host begins for the first time; but a cold start that was asked for and
  // never came about is still due.
  const bool begins = earlier.host_ended && earlier.start_kind != StartKind::cold;
  start_kind_ = begins ? StartKind::first : earlier.start_kind;
  std::vector<Duration> ages;
  for (const std::int64_t crash : earlier.crashes_unix_ns) {
    ages.emplace_back(unix_of(surroundings_.now()) - crash);
  }
  history_ = restored_history(surroundings_.now(), ages, earlier.ends_in_a_row, earlier.safe_mode, config_);
}

ManagedInstance::Configured ManagedInstance::configured() const {
  return {.application = config_.application,
          .scheduler = config_.scheduler,
          .process = configured_process(config_)};
}

// A configuration that was changed meanwhile is younger than the commands before. Whether it was.
bool ManagedInstance::use_configuration() {
  const Configured now = configured();
  const Configured before = std::exchange(begun_with_, now);
  if (before.scheduler != now.scheduler) {
    spdlog::info("instance {}: the configuration names another scheduler now; it takes the place of '{}'",
                 config_.name, scheduler_);
    scheduler_ = config_.scheduler;
  }
  if (before.application != now.application) {
    spdlog::info("instance {}: the configuration names another application now; it takes the place of '{}'",
                 config_.name, application_);
    application_ = own_.applications.boot();
    if (application_.empty()) application_ = config_.application;
    history_ = {};
    last_end_.clear();
    before_.reset();
  }
  // The change may have mended the cause of the failure.
  const bool mended = before.application != now.application || before.process != now.process;
  if (mended) taken_back_.clear();
  return mended;
}

// The part of the configuration that the process was not begun with; empty: none.
std::string ManagedInstance::awaited_changes() const {
  const Configured now = configured();
  std::vector<std::string_view> changed;
  if (begun_with_.application != now.application) changed.emplace_back("application");
  if (begun_with_.scheduler != now.scheduler) changed.emplace_back("scheduler");
  if (begun_with_.process != now.process) changed.emplace_back("core, priority band, settings or limits");
  if (changed.empty() || removed_) return "";
  return fmt::format("the configuration has changed: {}; restart it to use that", fmt::join(changed, ", "));
}

void ManagedInstance::reconfigure(const InstanceConfig& config) {
  const bool returns = std::exchange(removed_, false);
  status_.removed = 0;
  config_ = config;
  if (!idle_phase()) {
    tell_problems();
    return publish();
  }
  const bool failed = phase_ == Phase::down && status_.state == InstanceState::failed && unreadable_.empty();
  const bool mended = use_configuration();
  if (phase_ == Phase::down && (returns || (failed && mended))) {
    const bool stays = commanded_ && !wants_running_;
    const Decision decision =
        decided({.cause = EndCause::reconfigured, .order = stays ? Order::no_process : order()});
    if (decision.action != Decision::Action::leave) return carry_out(decision, "");
  }
  publish();
}

void ManagedInstance::remove() {
  removed_ = true;
  status_.removed = 1;
  if (config_.core < 0 && earlier_) {  // of an earlier manager: "CORE BAND SETTINGS"
    const std::string& process = earlier_->configured_process;
    const auto settings = process.find('/');
    if (settings != std::string::npos) config_.settings = process.substr(settings);
  }
  tell_problems();
  publish();
  refresh();
}

void ManagedInstance::resume() {
  host_.withdraw();
  if (use_configuration() && earlier_) earlier_->failed = false;
  if (application_ != config_.application) tell_boot_application();
  const EndCause cause = cause_of_beginning();
  if (earlier_) earlier_->process = InstanceWish::Process::none;
  if (cause == EndCause::unwatched) return ended_unwatched();
  const bool offline = earlier_ && commanded_ && earlier_->offline;
  const Decision decision = decided({.cause = cause, .order = offline ? Order::no_process : order()});
  carry_out(decision, decision.action == Decision::Action::go_offline ? last_end_ : text_of_beginning(cause));
}

// As an earlier manager has left it, and it has no process now.
EndCause ManagedInstance::cause_of_beginning() const noexcept {
  using Process = InstanceWish::Process;
  if (!unreadable_.empty()) return EndCause::wish_unreadable;
  if (!earlier_) return EndCause::never_begun;
  if (earlier_->failed) return EndCause::given_up;
  if (earlier_->host_ended) return EndCause::host_ended;
  if (earlier_->process == Process::up) return EndCause::unwatched;
  return earlier_->process == Process::setting_up ? EndCause::setting_up_unknown : EndCause::without_process;
}

std::string ManagedInstance::text_of_beginning(EndCause cause) const {
  if (cause == EndCause::wish_unreadable) {
    return fmt::format("its wanted state is not known: {}; start it or stop it", unreadable_);
  }
  if (cause == EndCause::given_up) return earlier_->problem;
  if (cause == EndCause::host_ended) return "ended with the host, and its policy is never to start it again";
  return cause == EndCause::setting_up_unknown ? "was being set up when its manager ended" : "";
}

void ManagedInstance::ended_unwatched() {
  const auto left = host_.left_runtime();
  const std::string forces = ended_forces_text(left ? left->forces : 0);
  host_.withdraw();
  start_kind_ = StartKind::after_fault;
  ended({.cause = EndCause::unwatched},
        fmt::format("ended while no manager ran{}{}", forces.empty() ? "" : "; ", forces));
}

// Its policy is never to start it again, so a process that is still being set up is waited for instead.
void ManagedInstance::look_for_process() {
  if (adopt()) return;
  if (surroundings_.now() < awaited_->until) return host_.set_timer(after(awaited_->interval));
  awaited_.reset();
  ended_unwatched();
}

// An operator's stop holds from here on, whatever becomes of the process meanwhile.
void ManagedInstance::follow_command(ControlVerb verb) {
  if (verb == ControlVerb::stop) {
    operation_->commanded_before = std::exchange(commanded_, true);
    operation_->wanted_before = std::exchange(wants_running_, false);
    unreadable_.clear();
  }
  remember();
}

void ManagedInstance::take_back_stop() {
  if (operation_->request.verb != ControlVerb::stop) return;
  commanded_ = operation_->commanded_before;
  wants_running_ = operation_->wanted_before;
}

InstanceWish ManagedInstance::wish() const {
  InstanceWish wish;
  wish.commanded = commanded_;
  wish.running = wants_running_;
  wish.stopping =
      (earlier_ && earlier_->stopping) || (operation_ && operation_->request.verb == ControlVerb::stop);
  wish.failed = phase_ == Phase::down && status_.state == InstanceState::failed;
  // That the configuration has lost it is nobody's stop.
  wish.offline = phase_ == Phase::down && !wish.failed && !(removed_ && wants_running_);
  if (wish.failed) wish.problem = status_.problem.view();
  wish.last_end = last_end_.substr(0, kMaxWishText);
  wish.application = application_;
  wish.application_before = before_.value_or("");
  wish.taken_back = taken_back_;
  wish.scheduler = scheduler_;
  wish.configured_application = begun_with_.application;
  wish.configured_scheduler = begun_with_.scheduler;
  wish.configured_process = begun_with_.process;
  wish.safe_mode = history_.safe_mode;
  wish.start_kind = start_kind_;
  wish.restarts = status_.restarts;
  wish.ends_in_a_row = history_.in_a_row;
  for (const TimePoint crash : history_.crashes) wish.crashes_unix_ns.push_back(unix_of(crash));
  if (status_.pid == 0) return wish;
  wish.process = phase_ == Phase::setting_up ? InstanceWish::Process::setting_up
                 : phase_ == Phase::adopting ? adopted_as_
                 : phase_ == Phase::ending   ? InstanceWish::Process::ending
                                             : InstanceWish::Process::up;
  return wish;
}

void ManagedInstance::remember() {
  if (!unreadable_.empty()) return;  // it stays as it is until an operator says what is to be
  if (unheard_ && !wish_known_ && !commanded_) return;  // until the process has answered
  InstanceWish now = wish();
  if (shutting_down_) {  // in order: that all processes end is nobody's wish
    if (!kept_) return;
    now = *kept_;
    now.host_ended = true;
    if (status_.pid == 0) now.process = InstanceWish::Process::none;
  }
  if (kept_ && now == *kept_) return;
  kept_ = now;
  own_.wishes.keep(now);
}

void ManagedInstance::tell_when_kept(const Operation& done, std::string text, const std::string& more) {
  const bool events =
      done.request.verb == ControlVerb::register_event || done.request.verb == ControlVerb::unregister_event;
  if (events) own_.wishes.keep_events();
  // A client that gets no text says by itself what is done.
  std::string said = text.empty()
                         ? fmt::format("{}: {}", config_.name,
                                       done_text(operation_of(done.request.verb), done.request.argument))
                         : text;
  if (!more.empty()) said = text = said + "; " + more;
  // Of what only the process carries out, nothing else is written: no disk is waited for.
  const bool written = events || done.request.verb == ControlVerb::set_scheduler;
  if (operation_of(done.request.verb).place == OperationPlace::instance && !written)
    return done.reply(ControlReply{.number = done.request.number, .code = ErrorCode::ok, .text = text});
  own_.wishes.when_kept(
      [reply = done.reply, number = done.request.number, text, said](const std::string& problem) {
        const std::string all = fmt::format("{}; a power cut would undo it: {}", said, problem);
        reply(ControlReply{.number = number, .code = ErrorCode::ok, .text = problem.empty() ? text : all});
      });
}

}  // namespace plchost
