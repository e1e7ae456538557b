// A ManagedInstance and a process that an earlier manager has made.

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "manager/supervisor/managed_instance.hpp"
#include "shm/log/log.hpp"

namespace plchost {

bool ManagedInstance::adopt() {
  using Process = InstanceWish::Process;
  const auto pid = host_.adopt();
  if (!pid) return false;
  if (application_ != config_.application) tell_boot_application();
  status_.pid = *pid;
  awaited_.reset();
  log_level_.clear();
  forget_signs();
  adopted_as_ = earlier_ ? std::exchange(earlier_->process, Process::none) : Process::none;
  if (adopted_as_ == Process::ending) {
    next_ = wants_running_ ? Next::run : Next::stay_stopped;
    ending_ = Ending::asked;
    host_.set_timer(after(kShutdownLimit));
    set_state(Phase::ending, InstanceState::stopping, "");
    return true;
  }
  // An earlier manager that knew no process of it can have ended while it made one.
  if (adopted_as_ == Process::none) adopted_as_ = Process::setting_up;
  unheard_ = true;
  set_up_limit_ = WorkLimit(kSetupLimit, surroundings_.now(), host_.processor_share());
  set_state(Phase::adopting, InstanceState::starting, "is being adopted");
  asked_at_ = surroundings_.now();
  const auto number = send(ControlVerb::status);
  if (!number) {
    finish_adoption(number.error().describe());
    return true;
  }
  asked_number_ = *number;
  host_.set_timer(after(kAdoptLimit));
  return true;
}

void ManagedInstance::finish_adoption(const std::string& problem) {
  auto runtime = host_.runtime();
  if (!runtime || runtime->pid != status_.pid) runtime = said_;
  if (!runtime) return wait_for_sign(problem.empty() ? "its answer does not say its state" : problem);
  unadopted_.clear();
  learn(*runtime);
  begins_running_ = runtime->running != 0;
  come_up();
  if (!history_.safe_mode && shown_state(*runtime) != status_.state) show_application(*runtime);
  if (!problem.empty()) {
    std::string text(status_.problem.view());
    text +=
        (text.empty() ? "" : "; ") + ("adopted, but it does not answer on its control socket: " + problem);
    carry_out(decided({.cause = EndCause::adoption_unanswered, .order = order()}), text);
    set_state(phase_, status_.state, text);
  }
  spdlog::info("instance {}: adopted process {}", config_.name, status_.pid);
  go_on_with_stop();
}

void ManagedInstance::go_on_with_stop() {
  const bool begun = earlier_ && std::exchange(earlier_->stopping, false);
  if (!begun || operation_ || wants_running_ || status_.state != InstanceState::running) return;
  spdlog::info("instance {}: stop, which an earlier manager has begun", config_.name);
  Operation stop{.request = {}, .reply = [](const ControlReply&) {}};
  stop.request.verb = ControlVerb::stop;
  stop.request.instance = config_.name;
  stop.of_predecessor = true;
  operation_ = std::move(stop);
  begin_stop();
}

void ManagedInstance::learn(const InstanceRuntime& said) {
  unheard_ = false;
  before_.reset();  // it is up
  unreadable_.clear();
  if (!wish_known_ && !commanded_) {
    wants_running_ = said.running != 0;
    // As an operator's stop: the next manager starts no machine that was found stopped, or on its way there.
    commanded_ = said.state == ApplicationState::stopped || said.state == ApplicationState::stopping ||
                 said.state == ApplicationState::single_cycle;
  }
  if (!said.scheduler.view().empty()) scheduler_ = said.scheduler.view();
  history_.safe_mode = said.application.view().empty() && !application_.empty();
  if (!history_.safe_mode) application_ = said.application.view();
}

// Without a page and without an answer nobody knows what the process is.
void ManagedInstance::wait_for_sign(const std::string& problem) {
  unadopted_ = fmt::format(
      "adopted, but it has no status page and does not answer on its control socket: {}; it is asked again "
      "every {} s",
      problem, std::chrono::duration_cast<std::chrono::seconds>(kAskAgain).count());
  tell_adoption();
  host_.set_timer(after(kAskInterval));
}

void ManagedInstance::tell_adoption() {
  const std::string_view between = unadopted_.empty() || starved_by_.empty() ? "" : "; ";
  set_state(Phase::adopting, InstanceState::starting,
            fmt::format("{}{}{}", unadopted_, between, starved_by_));
}

// An answer ends the adoption in on_reply().
void ManagedInstance::watch_adoption() {
  const bool starved = starved_now();
  heartbeat_.look(surroundings_.now(), signs_, starved);
  tell_starvation();
  if (unadopted_.empty()) return;
  const auto page = host_.runtime();
  if (page && page->pid == status_.pid) return finish_adoption("no answer");
  ask_for_status();
}

void ManagedInstance::adoption_timed_out() {
  if (unadopted_.empty()) return finish_adoption("no answer");
  const bool was_up = adopted_as_ == InstanceWish::Process::up;
  const Duration left =
      was_up ? Duration::zero()
             : set_up_limit_.left(surroundings_.now(), host_.processor_share(), starvation_.lasted());
  if (left > Duration::zero() || !heartbeat_.silent()) {
    return host_.set_timer(after(std::max(left, WorkLimit::kLook)));
  }
  unadopted_.clear();
  up_since_ = settled_ = surroundings_.now();
  start_kind_ = StartKind::warm;
  heard_of_ = true;  // supervised from here on, by its answers
  fall_silent("adopted, but it has no status page");
}

}  // namespace plchost
