#include "instances/runtime/instance/application_state.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

namespace plchost {

namespace {

using enum ApplicationState;

constexpr std::array kArrows = {
    std::pair{none, stopped},         std::pair{stopped, running},       std::pair{stopped, single_cycle},
    std::pair{stopped, exception},    std::pair{running, stopping},      std::pair{running, exception},
    std::pair{single_cycle, stopped}, std::pair{single_cycle, stopping}, std::pair{single_cycle, exception},
    std::pair{stopping, stopped},     std::pair{stopping, exception},
};

bool is_of_life(ControlVerb verb) noexcept {
  return verb == ControlVerb::start || verb == ControlVerb::stop || verb == ControlVerb::single_cycle ||
         verb == ControlVerb::set_scheduler || verb == ControlVerb::change_application;
}

Result<std::string> wrong_state(std::string text) {
  return failure(ErrorCode::wrong_state, std::move(text));
}

}  // namespace

Result<std::string> ApplicationLife::admit(ControlVerb verb) const {
  if (!is_of_life(verb)) return {};
  const bool chooses_scheduler = verb == ControlVerb::set_scheduler;
  const bool changes = verb == ControlVerb::change_application;
  switch (state_) {
    case none:
      if (chooses_scheduler) return {};
      if (changes) return wrong_state("there is no application to change online: load one");
      return wrong_state(
          fmt::format("there is no application to {}: load one", verb == ControlVerb::stop ? "stop" : "run"));
    case stopped:
      if (verb == ControlVerb::stop) {
        return wrong_state("the application is stopped; start and single cycle are possible");
      }
      return {};
    case running:
      if (verb == ControlVerb::stop || chooses_scheduler || changes) return {};
      return wrong_state(verb == ControlVerb::start
                             ? "the application runs; stop is possible"
                             : "the application runs: stop it first, a single cycle begins from stopped");
    case single_cycle:
      if (verb == ControlVerb::stop) return {};
      return failure(ErrorCode::busy,
                     "the application runs a single cycle: try again when it is over, or stop it");
    case stopping:
      return failure(ErrorCode::busy, "the application is stopping: try again when it has stopped");
    case exception:
      if (verb == ControlVerb::stop) {
        return fmt::format("it is in exception, so it does not run: {}; reset it to go on", problem_);
      }
      return wrong_state(fmt::format("it is in exception: {}; reset it first", problem_));
  }
  return {};
}

bool ApplicationLife::go_to(ApplicationState to, std::string_view reason) {
  const std::pair arrow(state_, to);
  if (std::ranges::find(kArrows, arrow) == kArrows.end()) return false;
  state_ = to;
  if (to == exception) problem_ = reason;
  record_(arrow.first, to, reason);
  return true;
}

}  // namespace plchost
