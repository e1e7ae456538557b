// The actions of an Instance on commands of its control socket.

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "instances/runtime/instance/instance.hpp"
#include "instances/runtime/tasks/registered_events.hpp"
#include "schedulers/policies/registry.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"
#include "shm/log/log_levels.hpp"

namespace plchost {

std::optional<ControlReply> Instance::handle(const ControlRequest& request,
                                             const InstanceSocket::Asker& asker) {
  auto done = obey(request);
  const bool takes_time = request.verb == ControlVerb::stop || request.verb == ControlVerb::single_cycle;
  if (done && request.verb == ControlVerb::change_application && change_) {
    waiting_ = Waiting{.asker = asker, .verb = request.verb};
    return std::nullopt;
  }
  const bool is_order = request.verb == ControlVerb::write_variable ||
                        request.verb == ControlVerb::force_variable ||
                        request.verb == ControlVerb::unforce_variable;
  if (done && is_order) {
    orders_.back().asker = asker;
    advance_orders();
    return std::nullopt;
  }
  if (done && takes_time && in_transition()) {
    answer_waiting(ErrorCode::wrong_state,
                   "stopped before it was over");  // a single cycle that is broken off
    waiting_ = Waiting{.asker = asker, .verb = request.verb};
    beat();
    advance();
    return std::nullopt;
  }
  if (request.verb != ControlVerb::status && request.verb != ControlVerb::debug) {
    spdlog::info("{} {}: {}", to_string(request.verb), request.argument,
                 done ? "done" : done.error().describe());
  }
  if (page_) beat();  // so that the client finds the new state in the page after the answer
  if (!done) return ControlReply{.number = 0, .code = done.error().code, .text = done.error().describe()};
  return ControlReply{.number = 0, .code = ErrorCode::ok, .text = *std::move(done)};
}

Result<std::string> Instance::obey(const ControlRequest& request) {
  if (request.instance != options_.launch.name) {
    return failure(ErrorCode::not_found, fmt::format("this is instance '{}', the request is for '{}'",
                                                     options_.launch.name, request.instance));
  }
  if (auto admitted = life_.admit(request.verb); !admitted || !admitted->empty()) {
    return admitted ? admitted
                    : failure_in(fmt::format("instance '{}'", options_.launch.name), admitted.error());
  }
  const bool ends_change = request.verb == ControlVerb::start || request.verb == ControlVerb::stop ||
                           request.verb == ControlVerb::single_cycle || request.verb == ControlVerb::shutdown;
  if (ends_change) drop_change(fmt::format("'{}' came first", to_string(request.verb)));
  return carry_out(request);
}

Result<std::string> Instance::carry_out(const ControlRequest& request) {
  using Do = Result<std::string> (*)(Instance&, const ControlRequest&);
  using Row = std::pair<ControlVerb, Do>;
  static constexpr std::array kOwn = {
      Row(ControlVerb::start, [](Instance& self, const auto& /*asked*/) { return self.start_by_command(); }),
      Row(ControlVerb::stop,
          [](Instance& self, const auto& /*asked*/) {
            self.begin_stop("asked to stop");
            return Result<std::string>();
          }),
      Row(ControlVerb::single_cycle,
          [](Instance& self, const auto& /*asked*/) { return self.begin_single_cycle(); }),
      Row(ControlVerb::set_scheduler,
          [](Instance& self, const auto& asked) { return self.set_scheduler(asked.argument); }),
      Row(ControlVerb::change_application,
          [](Instance& self, const auto& asked) { return self.begin_change(asked.argument); }),
      Row(ControlVerb::register_event,
          [](Instance& self, const auto& asked) { return self.change_registration(asked); }),
      Row(ControlVerb::unregister_event,
          [](Instance& self, const auto& asked) { return self.change_registration(asked); }),
      Row(ControlVerb::write_variable,
          [](Instance& self, const auto& asked) { return self.begin_order(asked); }),
      Row(ControlVerb::force_variable,
          [](Instance& self, const auto& asked) { return self.begin_order(asked); }),
      Row(ControlVerb::unforce_variable,
          [](Instance& self, const auto& asked) { return self.begin_order(asked); }),
      Row(ControlVerb::debug, [](Instance& self, const auto& asked) { return self.debug(asked.argument); }),
      Row(ControlVerb::reset_statistics,
          [](Instance& self, const auto& asked) { return self.reset_statistics(asked.argument); }),
      Row(ControlVerb::shutdown,
          [](Instance& self, const auto& /*asked*/) {
            self.begin_shutdown("the process is to end");
            return Result<std::string>();
          }),
      Row(ControlVerb::status,
          [](Instance& self, const auto& /*asked*/) { return Result<std::string>(self.status()); }),
      Row(ControlVerb::set_log_level,
          [](Instance& /*self*/, const auto& asked) { return set_log_level(asked.argument); })};
  const auto* const own = std::ranges::find(kOwn, request.verb, &Row::first);
  if (own != kOwn.end()) return own->second(*this, request);
  return failure(ErrorCode::unsupported,
                 fmt::format("the instance cannot do '{}'; send it to the manager", to_string(request.verb)));
}

Result<std::string> Instance::set_scheduler(const std::string& name) {
  PLCHOST_TRY(find_scheduler(name));
  if (life_.state() == ApplicationState::running) {
    let_tasks_go_on("the scheduler is exchanged");
    const auto switched = tasks_->switch_to(name, start_.settings.scheduler);
    if (switched) scheduler_ = name;
    resume_debugging();
    if (!switched) {
      Error error = switched.error();
      error.message = with_let_go(error.message);
      return std::unexpected(std::move(error));
    }
  }
  scheduler_ = name;
  return take_let_go();
}

Result<std::string> Instance::set_log_level(const std::string& name) {
  if (!is_log_level(name)) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("no log level '{}'; there are {}", shown(name), join_names(kLogLevels)));
  }
  spdlog::set_level(spdlog::level::from_str(name));
  return {};
}

Result<std::string> Instance::change_registration(const ControlRequest& request) {
  EventTable& events = host_->events();
  const bool add = request.verb == ControlVerb::register_event;
  const auto changed =
      add ? events.register_by_operator(request.argument) : events.unregister_by_operator(request.argument);
  if (!changed && changed.error().code != ErrorCode::already_exists) return std::unexpected(changed.error());
  const auto kept =
      write_operator_events(operator_events_path(options_.launch.run_directory, options_.launch.name),
                            events.registered_by_operator());
  if (!changed) return changed.error().message;  // it was there: the wish is fulfilled
  if (!kept) return fmt::format("done, but not kept for the next start: {}", kept.error().describe());
  return {};
}

Result<std::string> Instance::reset_statistics(const std::string& task) {
  if (!tasks_) {
    return failure(ErrorCode::wrong_state,
                   fmt::format("instance '{}' has no application, so no tasks", options_.launch.name));
  }
  PLCHOST_TRY(tasks_->reset_statistics(task));
  return {};
}

static_assert(std::to_underlying(ApplicationState::exception) == kLastApplicationState);

std::string Instance::status() const {
  return encode(InstanceReport{.pid = ::getpid(),
                               .state = std::to_underlying(life_.state()),
                               .problem = life_.problem(),
                               .application = application_ ? application_->path() : std::string(),
                               .scheduler = scheduler_,
                               .cores = cores_,
                               .memory_locked = real_time_.memory_locked});
}

}  // namespace plchost
