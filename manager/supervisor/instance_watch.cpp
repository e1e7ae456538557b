// What a ManagedInstance does when the control thread of its process stands still.

#include <utility>

#include <fmt/format.h>

#include "manager/supervisor/managed_instance.hpp"

namespace plchost {

void ManagedInstance::watch_heartbeat(const InstanceRuntime& runtime) {
  heartbeat_.look(surroundings_.now(), runtime.heartbeat_ns);
  // The control thread is in the set-up of the new version: the command's limit counts.
  if (takes_over()) return;
  if (heartbeat_.silent() == silent_) return;
  if (silent_) {
    answers_again(runtime);
  } else {
    fall_silent(runtime.problem.view());
  }
}

void ManagedInstance::fall_silent(std::string_view known) {
  silent_ = true;
  const std::string lost = surroundings_.keep_lost_faults();
  const std::string_view fault = known.empty() ? lost : known;
  set_state(
      Phase::up, InstanceState::exception,
      fmt::format("{}{}its control thread has not answered for {} s: it waits for a lock that a task was "
                  "caught with, or tasks leave it no processor time",
                  fault, fault.empty() ? "" : "; ",
                  std::chrono::duration_cast<std::chrono::seconds>(HeartbeatWatch::kLimit).count()));
  if (!operation_ || operation_->step != Step::forwarded) return;
  host_.set_timer(std::nullopt);
  finish(ErrorCode::timed_out, fmt::format("it is in exception now: {}; reset it", status_.problem.view()));
}

// It was kept from answering, and has missed nothing: what it says holds again.
void ManagedInstance::answers_again(const InstanceRuntime& runtime) {
  if (safe_mode_) {
    set_state(Phase::up, InstanceState::safe_mode, problem_when_up());
  } else {
    show_application(runtime);
  }
  silent_ = false;  // only now, so that the transition is told
}

}  // namespace plchost
