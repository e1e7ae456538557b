// How a ManagedInstance ends, and what the decision on that does: see restart_decision.hpp.

#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "manager/supervisor/managed_instance.hpp"
#include "shm/base/transient.hpp"
#include "shm/operations/operations.hpp"
#include "shm/process/dynamic_loader.hpp"

namespace plchost {

namespace {

// Nobody asked for this end, so code 0 is no success: it may be exit() in the middle of a cycle.
std::string unasked(const ExitStatus& status) {
  return status.describe() + (status.success() ? ", which nobody asked for" : "");
}

}  // namespace

void ManagedInstance::on_exit(const ExitStatus& status) {
  const std::string ended_forces = ended_forces_text(forces_of_process());
  status_.pid = 0;
  status_.core = -1;
  const bool guessed = unheard_ && !unreadable_.empty();
  // Neither an operator, nor an earlier manager, nor the process has said whether it is to run.
  const bool start_waits = operation_ && operation_->request.verb == ControlVerb::start;
  const bool nobodys_word = unheard_ && !wish_known_ && !commanded_ && !start_waits;
  const SetupStep reached = step_;
  end_orders(ErrorCode::unavailable, fmt::format("its process has ended: {}", status.describe()));
  forget_signs();
  host_.set_timer(std::nullopt);
  if (phase_ == Phase::ending) return asked_end();
  if (phase_ == Phase::setting_up) return set_up_ended(status, reached);
  if (phase_ != Phase::up && phase_ != Phase::adopting) return;
  if (guessed) {
    return ended({.cause = EndCause::wish_unreadable}, text_of_beginning(EndCause::wish_unreadable));
  }
  if (phase_ == Phase::up) start_kind_ = StartKind::after_fault;
  ended({.cause = nobodys_word ? EndCause::unwatched : cause_of(status),
         .lasted = phase_ == Phase::up ? surroundings_.now() - up_since_ : Duration::zero(),
         .has_earlier = phase_ == Phase::adopting && before_.has_value() && !removed_},
        ended_forces.empty() ? unasked(status) : unasked(status) + "; " + ended_forces);
}

void ManagedInstance::set_up_ended(const ExitStatus& status, SetupStep reached) {
  const bool loaded = before_.has_value() && !removed_;
  const bool refused = status.exited_with(kExitSetupFailed) || status.exited_with(kExitUsage);
  if (setup_failure_.empty() && reached == SetupStep::bind_core && status.exited_with(kExitNotLoaded)) {
    const std::string said = host_.last_line();
    const Error error = error_of_loader(said.empty() ? "the program could not be loaded" : said);
    transient_ = is_transient(error);
    setup_failure_ = transient_ ? said : error.message;
  }
  if (!setup_failure_.empty()) {
    ended({.cause = cause_of_refusal(), .has_earlier = loaded},
          fmt::format("{}: {}", status.describe(), setup_failure_));
  } else {
    ended({.cause = refused ? cause_of_refusal() : cause_of(status), .has_earlier = loaded}, unasked(status));
  }
}

// As it was asked to, and the next process is of the kind that was asked for.
void ManagedInstance::asked_end() {
  const Next next = in_time(std::exchange(next_, Next::nothing));
  const bool ends = next == Next::nothing;
  carry_out(decided({.cause = ends ? EndCause::told_to_end : EndCause::replaced,
                     .order = next == Next::run ? Order::run : Order::stop}),
            "");
  if (ends && operation_) {
    finish(ErrorCode::ok, fmt::format("'{}' has ended: it was removed from the configuration", config_.name));
  }
}

// The end of the process can outlast the client, who was told then that the restart has failed.
ManagedInstance::Next ManagedInstance::in_time(Next next) {
  if (next != Next::run || wants_running_ || !operation_) return next;
  const auto in_time = check_in_time(operation_->request.limit_ns);
  if (in_time) return next;
  finish(in_time.error().code, fmt::format("{}; its process begins stopped", in_time.error().message));
  return Next::stay_stopped;
}

Order ManagedInstance::order() const noexcept {
  if (!wants_running_) return Order::stop;
  return commanded_ ? Order::run : Order::none;
}

EndCause ManagedInstance::cause_of_refusal() const noexcept {
  if (name_taken_) return EndCause::name_taken;
  if (declaration_taken_) return EndCause::declaration_taken;
  if (limit_met_) return EndCause::limit_met;
  return transient_ ? EndCause::start_transient : EndCause::start_refused;
}

Decision ManagedInstance::decided(End end) {
  end.at = surroundings_.now();
  end.removed = removed_;
  Decision made = decide(end, history_, config_);
  history_ = made.history;
  return made;
}

void ManagedInstance::carry_out(const Decision& decision, const std::string& why) {
  using enum Decision::Action;
  switch (decision.action) {
    case leave:
      return;
    case start_now:
      return spawn(decision.runs ? Next::run : Next::stay_stopped);
    case start_earlier:
      return take_back_application(why);
    case start_in_order:
      return hold("is to be started");
    case back_off:
      host_.set_timer(after(decision.delay));
      return set_state(Phase::backing_off, InstanceState::waiting, why);
    case await_process:
      awaited_ = AwaitedProcess{.until = after(kSetupLimit), .interval = decision.delay};
      set_state(Phase::backing_off, InstanceState::waiting, why);
      return host_.set_timer(after(decision.delay));
    case bring_down:
      if (idle_phase()) return go_down(InstanceState::offline, why);
      if (phase_ != Phase::ending) end_process(Next::nothing);
      next_ = Next::nothing;
      return;
    case go_offline:
      return go_down(InstanceState::offline, why);
    case fail:
      return go_down(InstanceState::failed, why);
  }
}

// By itself, or it could not be started.
void ManagedInstance::ended(End end, const std::string& why) {
  // A stop that came while it was starting has its wish already.
  const bool cancelled =
      operation_ && operation_->request.verb == ControlVerb::stop && operation_->step == Step::until_up;
  end.order = cancelled ? Order::no_process : order();
  end.has_earlier = end.has_earlier && !cancelled;
  const Decision decision = decided(end);
  if (decision.action == Decision::Action::start_earlier) return carry_out(decision, why);
  last_end_ = why;
  std::string later;
  if (decision.action == Decision::Action::back_off) {
    if (decision.crash && !history_.safe_mode) {
      later = fmt::format("; crash {} of {} within {} s", history_.crashes.size(), config_.crash_limit,
                          std::chrono::ceil<std::chrono::seconds>(config_.crash_window).count());
    }
    later += fmt::format("; starts again{} {} ms later", history_.safe_mode ? " in safe mode" : "",
                         std::chrono::ceil<std::chrono::milliseconds>(decision.delay).count());
  }
  carry_out(decision, why + later);
  if (!operation_ || loading_aside()) return;
  if (cancelled) {
    finish(ErrorCode::ok, fmt::format("its process ended meanwhile: {}; it is not started again", why));
  } else {
    finish(ErrorCode::unavailable, fmt::format("{}{}the process of '{}' ended: {}{}", taken_back_,
                                               taken_back_.empty() ? "" : "; ", config_.name, why, later));
  }
}

}  // namespace plchost
