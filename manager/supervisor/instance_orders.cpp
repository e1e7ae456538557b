// Orders: commands for variables and to the debugger, beside all others. And what breaks a single cycle off.

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "manager/supervisor/managed_instance.hpp"
#include "shm/log/log.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

using namespace std::string_view_literals;

namespace {

constexpr std::array kOrders = {ControlVerb::debug, ControlVerb::write_variable, ControlVerb::force_variable,
                                ControlVerb::unforce_variable};
constexpr std::array kBreakOff = {ControlVerb::stop, ControlVerb::reset, ControlVerb::reset_cold,
                                  ControlVerb::restart};

// Commands that let tasks go on. All others may halt one, or keep it halted.
constexpr std::array kLettingGo = {"continue"sv, "delete"sv, "detach"sv};

bool contains(const auto& verbs, ControlVerb verb) {
  return std::ranges::find(verbs, verb) != verbs.end();
}

}  // namespace

// "SESSION COMMAND"; the instance knows the rest. A debug build may run on from a time when it was allowed.
Result<void> ManagedInstance::check_debugger(std::string_view command) const {
  if (surroundings_.host.allow_debug) return {};
  command.remove_prefix(std::min(command.find(' '), command.size()));
  command.remove_prefix(std::min(command.find_first_not_of(' '), command.size()));
  if (std::ranges::find(kLettingGo, command.substr(0, command.find(' '))) != kLettingGo.end()) return {};
  return failure(ErrorCode::refused,
                 "this host says allow_debug = false: of the debugger's commands only continue, delete and "
                 "detach are carried out");
}

bool ManagedInstance::waits_for_single_cycle() const noexcept {
  return operation_ && operation_->step == Step::forwarded &&
         operation_->request.verb == ControlVerb::single_cycle;
}

bool ManagedInstance::is_order(ControlVerb verb) const noexcept {
  return contains(kOrders, verb) && phase_ == Phase::up && !silent_ &&
         (!operation_ || waits_for_single_cycle());
}

// They wait for a moment in which no task is in a cycle, or for a task that halts, and nothing waits for
// them.
void ManagedInstance::begin_order(ControlRequest request, ControlReplyFunction reply) {
  const auto refuse = [&](ErrorCode code, std::string text) {
    reply(ControlReply{.number = request.number, .code = code, .text = std::move(text)});
  };
  const auto number = send_limited(request.verb, request);
  if (!number) return refuse(number.error().code, number.error().describe());
  const TimePoint until = after(operation_of(request.verb).limit);
  orders_.push_back(
      {.request = std::move(request), .reply = std::move(reply), .number = *number, .until = until});
}

bool ManagedInstance::ends_order(const ControlReply& reply) {
  const auto order = std::ranges::find(orders_, reply.number, &ForwardedOrder::number);
  if (order == orders_.end()) return false;
  end_order(order, reply.code, reply.text);
  return true;
}

void ManagedInstance::end_order(std::vector<ForwardedOrder>::iterator order, ErrorCode code,
                                const std::string& text) {
  // Taken out first: the receiver of the reply may ask for the next thing at once.
  const ForwardedOrder done = std::move(*order);
  orders_.erase(order);
  if (code != ErrorCode::ok) {
    spdlog::warn("instance {}: {} failed: {}", config_.name, to_string(done.request.verb), text);
  }
  done.reply(ControlReply{.number = done.request.number, .code = code, .text = text});
}

void ManagedInstance::end_orders(ErrorCode code, const std::string& text) {
  while (!orders_.empty()) end_order(orders_.begin(), code, text);
}

void ManagedInstance::end_late_orders() {
  const auto is_late = [this](const ForwardedOrder& order) { return surroundings_.now() >= order.until; };
  for (auto late = std::ranges::find_if(orders_, is_late); late != orders_.end();
       late = std::ranges::find_if(orders_, is_late)) {
    end_order(late, ErrorCode::timed_out, no_answer_text(late->request.verb));
  }
}

bool ManagedInstance::makes_room_for(ControlVerb verb) {
  if (!operation_) return true;
  if (!waits_for_single_cycle() || !contains(kBreakOff, verb)) return false;
  host_.set_timer(std::nullopt);
  fail(ErrorCode::wrong_state, fmt::format("broken off by '{}'", to_string(verb)));
  return true;
}

}  // namespace plchost
