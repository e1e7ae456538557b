// A single cycle, and commands beside it.

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "manager/supervisor/managed_instance.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

constexpr std::array kBeside = {ControlVerb::debug, ControlVerb::write_variable, ControlVerb::force_variable,
                                ControlVerb::unforce_variable};
constexpr std::array kBreakOff = {ControlVerb::stop, ControlVerb::reset, ControlVerb::reset_cold,
                                  ControlVerb::restart};

}  // namespace

bool ManagedInstance::makes_room_for(ControlVerb verb) {
  if (!operation_) return true;
  const bool waits =
      operation_->step == Step::forwarded && operation_->request.verb == ControlVerb::single_cycle;
  if (!waits) return false;
  if (std::ranges::find(kBeside, verb) != kBeside.end()) {
    aside_ = std::exchange(operation_, std::nullopt);
    return true;
  }
  if (std::ranges::find(kBreakOff, verb) == kBreakOff.end()) return false;
  host_.set_timer(std::nullopt);
  finish(ErrorCode::wrong_state, fmt::format("broken off by '{}'", to_string(verb)));
  look_again();
  return true;
}

void ManagedInstance::resume_aside() {
  if (!aside_ || operation_) return;
  operation_ = std::exchange(aside_, std::nullopt);
  host_.set_timer(operation_->until);
}

void ManagedInstance::end_aside(ErrorCode code, const std::string& text) {
  const Operation done = *std::exchange(aside_, std::nullopt);
  if (code != ErrorCode::ok) {
    spdlog::warn("instance {}: {} failed: {}", config_.name, to_string(done.request.verb), text);
  }
  done.reply(ControlReply{.number = done.request.number, .code = code, .text = text});
}

}  // namespace plchost
