#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "manager/config/load_config.hpp"
#include "manager/supervisor/managed_instance.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"
#include "shm/operations/operations.hpp"
#include "shm/toml/section_reader.hpp"

namespace plchost {

void ManagedInstance::handle(const ControlRequest& request, ControlReplyFunction reply) {
  ControlRequest checked = request;
  const auto refuse = [&](ErrorCode code, std::string text) {
    reply(ControlReply{.number = request.number, .code = code, .text = std::move(text)});
  };
  refresh();  // the present decision rests on it
  if (shutting_down_) return refuse(ErrorCode::unavailable, "the manager is shutting down");
  if (auto good = check_argument(checked); !good) return refuse(good.error().code, good.error().describe());
  if (removed_ && checked.verb != ControlVerb::stop) {
    return refuse(
        ErrorCode::wrong_state,
        fmt::format("'{}' was removed from the configuration: it runs until it is stopped; put it back "
                    "into the file and reload that for anything else",
                    config_.name));
  }
  if (is_order(checked.verb)) {
    spdlog::info("instance {}: {} {}", config_.name, to_string(checked.verb), checked.argument);
    return begin_order(std::move(checked), std::move(reply));
  }
  if (operation_ && operation_->of_predecessor && checked.verb == operation_->request.verb) {
    operation_->request.number = request.number;  // the client asks again for what goes on already
    operation_->reply = std::move(reply);
    operation_->of_predecessor = false;
    return;
  }
  if (!makes_room_for(checked.verb)) {
    return refuse(ErrorCode::busy, fmt::format("instance '{}' is busy with '{}'; try again when it is done",
                                               config_.name, to_string(operation_->request.verb)));
  }
  spdlog::info("instance {}: {} {}", config_.name, to_string(checked.verb), checked.argument);
  operation_ = Operation{.request = std::move(checked), .reply = std::move(reply)};
  follow_command(operation_->request.verb);
  if (loads_online()) {
    if (auto good = check_online(); !good) return finish(good.error().code, good.error().message);
  }
  carry_out(operation_->request.verb);
}

void ManagedInstance::carry_out(ControlVerb verb) {
  if (operation_of(verb).place == OperationPlace::instance) return begin_forwarded();
  using Begin = void (*)(ManagedInstance&);
  static constexpr std::array kOwn = {
      std::pair<ControlVerb, Begin>(ControlVerb::start, [](ManagedInstance& self) { self.begin_start(); }),
      std::pair<ControlVerb, Begin>(ControlVerb::stop, [](ManagedInstance& self) { self.begin_stop(); }),
      std::pair<ControlVerb, Begin>(
          ControlVerb::reset,
          [](ManagedInstance& self) { self.fresh_process(Next::stay_stopped, StartKind::warm); }),
      std::pair<ControlVerb, Begin>(
          ControlVerb::reset_cold,
          [](ManagedInstance& self) { self.fresh_process(Next::stay_stopped, StartKind::cold); }),
      std::pair<ControlVerb, Begin>(
          ControlVerb::restart,
          [](ManagedInstance& self) { self.fresh_process(Next::run, StartKind::warm); }),
      std::pair<ControlVerb, Begin>(ControlVerb::load_application,
                                    [](ManagedInstance& self) { self.begin_load(); }),
      std::pair<ControlVerb, Begin>(ControlVerb::download_application,
                                    [](ManagedInstance& self) { self.begin_download(); }),
      std::pair<ControlVerb, Begin>(ControlVerb::rollback_application,
                                    [](ManagedInstance& self) { self.begin_rollback(); })};
  const auto* const own = std::ranges::find(kOwn, verb, &std::pair<ControlVerb, Begin>::first);
  if (own != kOwn.end()) return own->second(*this);
  finish(ErrorCode::unsupported, fmt::format("the manager does not know '{}'", to_string(verb)));
}

Result<void> ManagedInstance::check_argument(ControlRequest& request) const {
  const auto& asked = operation_of(request.verb);
  switch (asked.place) {
    case OperationPlace::host:
      return failure(ErrorCode::invalid_argument,
                     fmt::format("'{}' is for the whole host: name no instance", asked.name));
    case OperationPlace::server:
      return failure(ErrorCode::unsupported, fmt::format("'{}' is answered by the API server", asked.name));
    case OperationPlace::internal:
      return failure(ErrorCode::unsupported,
                     fmt::format("'{}' is between the manager and an instance only", asked.name));
    case OperationPlace::manager:
    case OperationPlace::instance:
      break;
  }
  switch (asked.argument) {
    case OperationArgument::scheduler: {
      const std::vector<std::string_view>& known = surroundings_.schedulers;
      if (std::ranges::find(known, request.argument) != known.end()) return {};
      return failure(ErrorCode::invalid_argument,
                     fmt::format("no scheduler '{}'; there are {}{}", shown(request.argument),
                                 join_names(known), suggestion(cut(request.argument, kShownBytes), known)));
    }
    case OperationArgument::event:
      return check_name("event", request.argument, kMaxEventName);
    case OperationArgument::task_or_none:
      return request.argument.empty() ? Result<void>() : check_name("task", request.argument, kMaxTaskName);
    case OperationArgument::variable_value:
    case OperationArgument::variable_or_all:  // the instance knows its variables
    case OperationArgument::none:
      return {};
    case OperationArgument::debug_command:
      return check_debugger(request.argument);
    case OperationArgument::path:
      return check_path(request);
    case OperationArgument::file:
      return check_file_name(request.argument);
  }
  return {};
}

Result<void> ManagedInstance::check_path(ControlRequest& request) const {
  if (request.argument.empty() || request.argument.find('\0') != std::string::npos) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("{} needs the path of a file on the host", to_string(request.verb)));
  }
  std::string path = resolve_path(surroundings_.folder, request.argument);
  if (path.size() > kMaxPath) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("path of {} characters; allowed are up to {}", path.size(), kMaxPath));
  }
  request.argument = std::move(path);
  return {};
}

void ManagedInstance::begin_start() {
  if (idle_phase()) return fresh_process(Next::run, start_kind_);
  forward_or_wait();
}

void ManagedInstance::begin_stop() {
  if (phase_ == Phase::down) {
    return finish(ErrorCode::ok, fmt::format("'{}' has no process: nothing to stop", config_.name));
  }
  const EndCause cause = idle_phase() ? EndCause::stop_of_waiting : EndCause::operators_stop;
  const Decision decision = decided({.cause = cause, .order = Order::stop});
  if (decision.action == Decision::Action::bring_down) operation_->step = Step::fresh_process;
  carry_out(decision, last_end_);
  if (decision.action == Decision::Action::go_offline) {
    finish(ErrorCode::ok, fmt::format("'{}' was waiting to be started; that is cancelled", config_.name));
  } else if (decision.action != Decision::Action::leave) {
    return;  // the reply comes when the process has ended
  } else if (silent_) {
    fresh_process(Next::stay_stopped, StartKind::warm);
  } else {
    forward_or_wait();
  }
}

void ManagedInstance::begin_load() {
  operation_->step = Step::checking;
  LaunchOptions launch = launch_options(Next::run);
  launch.application = operation_->request.argument;
  launch.kept_settings = false;
  const auto started = host_.check_application(launch);
  if (!started) finish(started.error().code, started.error().describe());
}

void ManagedInstance::on_application_checked(const Result<void>& result) {
  if (!operation_ || operation_->step != Step::checking) return;
  if (!result) {
    return finish(result.error().code,
                  fmt::format("{} is refused: {}", operation_->request.argument, result.error().describe()));
  }
  if (const auto in_time = check_in_time(operation_->request.limit_ns); !in_time) {
    return finish(in_time.error().code, in_time.error().message);
  }
  apply_loaded_application();
}

void ManagedInstance::apply_loaded_application() {
  if (removed_) return finish(ErrorCode::wrong_state, "it was removed from the configuration meanwhile");
  if (loads_online()) return begin_change();
  const bool works = phase_ == Phase::up && !history_.safe_mode && !silent_ && !application_.empty();
  if (works) before_ = application_;
  application_ = operation_->request.argument;
  begun_with_.application = config_.application;  // the command is younger
  if (phase_ == Phase::down && status_.state == InstanceState::offline) {
    publish();
    return finish(ErrorCode::ok,
                  fmt::format("'{}' has no process: remembered for its next start", config_.name));
  }
  fresh_process(wants_running_ ? Next::run : Next::stay_stopped, StartKind::first);
}

void ManagedInstance::begin_forwarded() {
  if (!idle_phase()) return forward_or_wait();
  if (operation_->request.verb != ControlVerb::set_scheduler) {
    return finish(ErrorCode::wrong_state, fmt::format("'{}' has no process; start it first", config_.name));
  }
  scheduler_ = operation_->request.argument;
  publish();
  finish(ErrorCode::ok, fmt::format("'{}' has no process: remembered for its next start", config_.name));
}

void ManagedInstance::forward_or_wait() {
  if (phase_ != Phase::up) {
    operation_->step = Step::until_up;
    return;
  }
  const ControlVerb verb = operation_->request.verb;
  const bool running = status_.state == InstanceState::running;
  const bool safe_mode = status_.state == InstanceState::safe_mode;
  const bool begins = verb == ControlVerb::start || verb == ControlVerb::single_cycle;
  if (silent_ || (begins && status_.state == InstanceState::exception)) {
    finish(ErrorCode::wrong_state,
           fmt::format("'{}' is in exception: {}; reset it first", config_.name, status_.problem.view()));
  } else if (verb == ControlVerb::stop && status_.state == InstanceState::exception) {
    finish(ErrorCode::ok, fmt::format("'{}' is in exception, so it does not run: {}; reset it to go on",
                                      config_.name, status_.problem.view()));
  } else if (begins && safe_mode) {
    finish(ErrorCode::wrong_state,
           fmt::format("'{}' is in safe mode; load an application, or reset it", config_.name));
  } else if (verb == ControlVerb::start && running) {
    commanded_ = wants_running_ = true;
    finish(ErrorCode::ok, fmt::format("'{}' is running already", config_.name));
  } else if (verb == ControlVerb::stop && !running && status_.state != InstanceState::stopping) {
    finish(ErrorCode::ok, fmt::format("'{}' is stopped already", config_.name));
  } else {
    forward();
  }
}

void ManagedInstance::forward() {
  // It may have waited for the process to come up.
  if (const auto in_time = check_in_time(operation_->request.limit_ns); !in_time) {
    take_back_stop();
    return finish(in_time.error().code, in_time.error().message);
  }
  operation_->step = Step::forwarded;
  const auto number = send_limited(operation_->request.verb, operation_->request);
  if (!number) return finish(number.error().code, number.error().describe());
  operation_->forwarded_number = *number;
  host_.set_timer(after(operation_of(operation_->request.verb).limit));
  if (operation_->request.verb == ControlVerb::stop) {
    set_state(Phase::up, InstanceState::stopping, problem_when_up());
  }
}

void ManagedInstance::finish_forwarded(const ControlReply& reply) {
  host_.set_timer(std::nullopt);
  settled_ = surroundings_.now();
  const ControlRequest request = operation_->request;
  if (reply.code == ErrorCode::ok) {
    if (request.verb == ControlVerb::set_scheduler) {
      scheduler_ = request.argument;
      begun_with_.scheduler = config_.scheduler;  // the command is younger
    }
    if (loads_online()) {
      application_ = request.argument;
      begun_with_.application = config_.application;
      // Another one runs now, and the settings of its next process are those of the file.
      if (!std::exchange(taken_back_, {}).empty()) status_.problem.assign(problem_when_up());
    }
    if (request.verb == ControlVerb::start || request.verb == ControlVerb::stop) {
      commanded_ = true;
      wants_running_ = request.verb == ControlVerb::start;
      last_end_.clear();
      set_state(Phase::up, wants_running_ ? InstanceState::running : InstanceState::stopped,
                problem_when_up());
    } else {
      publish();
    }
  }
  const std::string version = reply.code == ErrorCode::ok ? loaded_text() : std::string();
  std::string text = version.empty() ? reply.text : fmt::format("{}, {}", version, reply.text);
  const bool is_addition = request.verb == ControlVerb::stop || request.verb == ControlVerb::set_scheduler;
  if (reply.code == ErrorCode::ok && is_addition && !text.empty()) {
    text = fmt::format("{}: {}; {}", config_.name, done_text(operation_of(request.verb), request.argument),
                       text);
  }
  if (reply.code == ErrorCode::ok) return finish(reply.code, text);
  fail(reply.code, text);
}

// The state comes before the answer: a client that looks after the answer sees what the command has done.
void ManagedInstance::fail(ErrorCode code, const std::string& text) {
  auto failed = std::exchange(operation_, std::nullopt);
  look_again();
  operation_ = std::move(failed);
  finish(code, text);
}

// A command has failed: the process knows what has become of it.
void ManagedInstance::look_again() {
  if (phase_ != Phase::up || operation_) return;
  settled_ = {};
  refresh();
  if (status_.state == InstanceState::stopping && !host_.runtime()) {
    set_state(Phase::up, InstanceState::running, problem_when_up());
  }
}

void ManagedInstance::finish(ErrorCode code, const std::string& text) {
  if (sets_boot(code)) return set_boot(text);
  // Emptied first: the receiver of the reply may ask for the next thing at once.
  const Operation done = std::move(*operation_);
  operation_.reset();
  const bool holds = done.request.verb == ControlVerb::stop && order() == Order::stop;
  const std::string refused = holds ? text + "; its next process begins stopped" : text;
  if (code != ErrorCode::ok) {
    spdlog::warn("instance {}: {} failed: {}", config_.name, to_string(done.request.verb), refused);
  }
  remember();
  const std::string ended = ended_forces_text(std::exchange(ended_forces_, 0));
  if (code == ErrorCode::ok) {
    tell_when_kept(done, text, ended);
  } else {
    done.reply(ControlReply{.number = done.request.number,
                            .code = code,
                            .text = ended.empty() ? refused : refused + "; " + ended});
  }
}

}  // namespace plchost
