// A ManagedInstance and a process whose control thread stands still, or whose page is damaged.

#include <utility>

#include <fmt/format.h>

#include "manager/supervisor/managed_instance.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

InstanceRuntime runtime_of(const InstanceReport& report) {
  InstanceRuntime runtime;
  runtime.pid = report.pid;
  runtime.state = static_cast<ApplicationState>(report.state);
  runtime.running = runtime.state == ApplicationState::running ? 1 : 0;
  runtime.problem.assign(report.problem);
  runtime.scheduler.assign(report.scheduler);
  runtime.application.assign(report.application);
  return runtime;
}

}  // namespace

void ManagedInstance::forget_signs() {
  silent_ = false;
  heartbeat_ = {};
  page_beat_ = HeartbeatWatch(kPageLimit);
  heard_of_ = false;
  page_damaged_ = false;
  asked_number_ = 0;
  answers_ = 0;
  said_.reset();
  unheard_ = false;
  unadopted_.clear();
  starvation_.forget();
  starved_by_.clear();
  step_ = SetupStep::bind_core;
  sign_at_ = surroundings_.now();
}

// Its page is written with each force, and outlasts a crash.
std::uint32_t ManagedInstance::forces_of_process() {
  const auto page = host_.runtime();
  const auto& newest = page && page->pid == status_.pid ? page : said_;
  return newest ? newest->forces : 0;
}

// The process's present report of itself; nothing: it has none.
std::optional<InstanceRuntime> ManagedInstance::watch_process() {
  auto page = host_.runtime();
  if (page && page->pid != status_.pid) page.reset();
  if (page && page->heartbeat_ns != last_beat_) {
    last_beat_ = page->heartbeat_ns;
    ++signs_;
    heard_of_ = true;
    answers_ = 0;
  }
  const bool starved = starved_now();
  page_beat_.look(surroundings_.now(), page ? last_beat_ : 0, starved);
  // Whether the page is damaged or the process stands still, the process itself can tell.
  const bool believed = page && !page_beat_.silent();
  if (believed) {
    said_ = page;
  } else if (page_beat_.silent() && !takes_over()) {
    ask_for_status();
  }
  if (heard_of_) watch_heartbeat(starved);
  tell_starvation();
  if (page_damaged_ && believed) {
    page_damaged_ = false;
    tell_problems();
  }
  return said_;
}

// A process that is being set up does not listen yet: it is told when it is up.
void ManagedInstance::use_log_level() {
  const std::string& level = surroundings_.host.log_level;
  if (phase_ != Phase::up || log_level_ == level) return;
  if (send(ControlVerb::set_log_level, level)) log_level_ = level;
}

void ManagedInstance::ask_for_status() {
  const TimePoint now = surroundings_.now();
  if (now - asked_at_ < (asked_number_ != 0 ? kAskAgain : kAskInterval)) return;
  asked_at_ = now;
  if (const auto number = send(ControlVerb::status)) asked_number_ = *number;
}

// false: it is no answer to the question for its status.
bool ManagedInstance::hear(const ControlReply& reply) {
  const auto report = decode_instance_report(reply.text);
  if (reply.code != ErrorCode::ok || !report || report->pid != status_.pid) return false;
  ++signs_;
  heard_of_ = true;
  // A process that was only busy answers all questions in a row before the heartbeats in its page resume: the
  // last one counts, and is not enough.
  if (reply.number == asked_number_) {
    asked_number_ = 0;
    ++answers_;
  }
  constexpr int kAnswers = 2;
  if (answers_ >= kAnswers && phase_ == Phase::up && !page_damaged_) {
    page_damaged_ = true;
    spdlog::warn(
        "instance {}: its status page does not tell what it says itself: another program has damaged "
        "it; restart the instance to have its figures again",
        config_.name);
    tell_problems();
  }
  said_ = runtime_of(*report);
  return true;
}

void ManagedInstance::tell_problems() {
  if (phase_ != Phase::up || silent_ || operation_ || status_.state == InstanceState::exception) return;
  set_state(phase_, status_.state, problem_when_up());
}

// Since the last look other programs have kept the process from its core. While it gives signs of itself,
// nobody looks.
bool ManagedInstance::starved_now() {
  const TimePoint now = surroundings_.now();
  if (std::exchange(seen_signs_, signs_) != signs_) {
    sign_at_ = now;
    starvation_.forget();
  }
  return now - sign_at_ >= kStarvationSuspected && starvation_.look(now, host_.processor_use());
}

void ManagedInstance::tell_starvation() {
  const bool starved = starvation_.lasted() >= HeartbeatWatch::kLimit;
  if (starved == !starved_by_.empty()) return;
  starved_by_.clear();
  if (starved) {
    const std::string taker = host_.processor_taker();
    starved_by_ = fmt::format(
        "other programs have kept its core from its control thread for {} s: {}; it answers when the core is "
        "free",
        std::chrono::duration_cast<std::chrono::seconds>(HeartbeatWatch::kLimit).count(),
        taker.empty() ? "none is seen there, so a limit of its control group or the machine below takes it"
                      : taker + " has it now");
  }
  if (phase_ == Phase::setting_up) set_state(phase_, status_.state, starved_by_);
  if (phase_ == Phase::adopting) tell_adoption();
  const bool excepted = silent_ || status_.state == InstanceState::exception;
  if (phase_ == Phase::up && !excepted) set_state(phase_, status_.state, problem_when_up());
}

void ManagedInstance::watch_set_up() {
  const bool starved = starved_now();
  tell_starvation();
  if (step_ != SetupStep::start_scheduler) return;
  // From here on tasks run: one of them can be caught with a lock that the rest of the set-up takes.
  heartbeat_.look(surroundings_.now(), signs_, starved);
  if (heartbeat_.silent() && !host_.keep_lost_faults().empty()) come_up();
}

void ManagedInstance::set_up_timed_out() {
  const Duration left =
      set_up_limit_.left(surroundings_.now(), host_.processor_share(), starvation_.lasted());
  if (left > Duration::zero()) return host_.set_timer(after(left));
  set_up_failed(fmt::format("was not ready after {} s: its step '{}' has not ended",
                            std::chrono::duration_cast<std::chrono::seconds>(kSetupLimit).count(),
                            to_string(step_)));
}

void ManagedInstance::watch_heartbeat(bool starved) {
  heartbeat_.look(surroundings_.now(), signs_, starved);
  // The control thread is in the set-up of the new version: the command's limit counts.
  if (takes_over()) return;
  if (heartbeat_.silent() == silent_) return;
  if (silent_) {
    answers_again();
  } else {
    fall_silent(said_ ? said_->problem.view() : std::string_view());
  }
}

void ManagedInstance::fall_silent(std::string_view known) {
  silent_ = true;
  const std::string lost = host_.keep_lost_faults();
  const std::string_view fault = known.empty() ? lost : known;
  set_state(
      Phase::up, InstanceState::exception,
      fmt::format("{}{}its control thread has not answered for {} s: it waits for a lock that a task was "
                  "caught with, tasks leave it no processor time, or a signal stopped it",
                  fault, fault.empty() ? "" : "; ",
                  std::chrono::duration_cast<std::chrono::seconds>(HeartbeatWatch::kLimit).count()));
  carry_out(decided({.cause = EndCause::silent, .order = order()}), std::string(status_.problem.view()));
  host_.forget_requests();
  end_orders(ErrorCode::timed_out, fmt::format("it is in exception now: {}", status_.problem.view()));
  if (!operation_) return;
  if (operation_->step == Step::until_up) return carry_out(operation_->request.verb);
  if (operation_->step != Step::forwarded) return;
  host_.set_timer(std::nullopt);
  const bool is_stop = operation_->request.verb == ControlVerb::stop;
  finish(
      ErrorCode::timed_out,
      fmt::format(
          "it is in exception now: {}; reset it{}", status_.problem.view(),
          is_stop ? ". If it runs on, its next process is stopped all the same: start takes that back" : ""));
}

// It was kept from answering, and has missed nothing: its report holds again.
void ManagedInstance::answers_again() {
  if (unheard_ && said_) learn(*said_);
  if (history_.safe_mode) {
    set_state(Phase::up, InstanceState::safe_mode, problem_when_up());
  } else if (said_) {
    show_application(*said_);
  }
  silent_ = false;  // only now, so that the transition is told
}

}  // namespace plchost
