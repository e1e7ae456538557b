// How the variables of an Instance's application are read, written and forced from outside.

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/instance/instance.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"
#include "shm/operations/operations.hpp"
#include "shm/variables/order_text.hpp"

namespace plchost {

namespace {

// For a moment in which no task is in a cycle. Less than the manager waits for an answer.
constexpr auto kOrderPatience = std::chrono::seconds(2);
constexpr std::size_t kMostOrders = 64;

VariableOrder::Kind kind_of(ControlVerb verb) noexcept {
  if (verb == ControlVerb::write_variable) return VariableOrder::Kind::write;
  return verb == ControlVerb::force_variable ? VariableOrder::Kind::force : VariableOrder::Kind::unforce;
}

}  // namespace

Result<void> Instance::admit_order() const {
  switch (life_.state()) {
    case ApplicationState::none:
      return failure(ErrorCode::wrong_state, "there is no application, so no variables: load one");
    case ApplicationState::exception:
      return failure(ErrorCode::wrong_state,
                     fmt::format("it is in exception: {}; reset it first", life_.problem()));
    case ApplicationState::stopped:
    case ApplicationState::running:
    case ApplicationState::single_cycle:
    case ApplicationState::stopping:
      return {};
  }
  return {};
}

// The client hears of it by advance_orders().
Result<std::string> Instance::begin_order(const ControlRequest& request) {
  PLCHOST_TRY(admit_order());
  if (change_) return failure(ErrorCode::busy, "an online change is under way: try again when it is done");
  if (orders_.size() == kMostOrders) {
    return failure(
        ErrorCode::busy,
        fmt::format("{} changes of variables wait for the end of a cycle: try again", kMostOrders));
  }
  PLCHOST_TRY_ASSIGN(auto order, host_->variables().order(kind_of(request.verb), request.argument));
  orders_.push_back({.asker = {},
                     .verb = request.verb,
                     .argument = request.argument,
                     .limit = MonotonicClock::now() + kOrderPatience,
                     .order = {}});
  if (orders_.size() == 1) orders_.back().order = std::move(order);
  return {};
}

bool Instance::in_moment(const std::function<void()>& action) {
  return tasks_ && tasks_->between_cycles(action).has_value();
}

void Instance::advance_orders() {
  while (!orders_.empty()) {
    PendingOrder& first = orders_.front();
    VariableService& variables = host_->variables();
    ControlReply reply;
    if (const auto admitted = admit_order(); !admitted)
      return drop_orders(admitted.error().code, admitted.error().message);
    Result<void> fine;
    if (!first.order) {
      auto order = variables.order(kind_of(first.verb), first.argument);
      if (order) {
        first.order = *std::move(order);
      } else {
        fine = std::unexpected(std::move(order).error());
      }
    }
    if (fine && !in_moment([&] { variables.make(*first.order); })) {
      if (MonotonicClock::now() < first.limit) return;
      fine = failure(
          ErrorCode::timed_out,
          fmt::format(
              "at each look for {} s a task was within its cycle, the last time {}; nothing is changed",
              kOrderPatience.count(), join_names(tasks_->tasks_in_cycle())));
    }
    if (fine) {
      reply.text = variables.describe(*first.order);
      // Operators read the log, also where they may not read variables.
      spdlog::info("variable {}", without_values(reply.text));
      beat();  // so that the client finds the number of forces in the page
    } else {
      reply = {.number = 0, .code = fine.error().code, .text = fine.error().describe()};
      spdlog::info("{} {}: {}", to_string(first.verb), shown(first.argument), reply.text);
    }
    const auto asker = first.asker;
    orders_.pop_front();
    if (control_) control_->answer(asker, std::move(reply));
  }
}

void Instance::drop_orders(ErrorCode code, const std::string& why) {
  for (const PendingOrder& order : std::exchange(orders_, {})) {
    if (control_) control_->answer(order.asker, {.number = 0, .code = code, .text = why});
  }
}

void Instance::advance_values() {
  if (!values_ || !values_->has_work()) return;
  const bool later = tasks_ && life_.state() != ApplicationState::exception;
  values_->advance([this](const std::function<void()>& action) { return in_moment(action); }, later);
}

void Instance::log_ended_forces(std::string_view why) {
  if (!host_ || host_->variables().forces().size() == 0) return;
  spdlog::warn("{}, because {}: {}", ended_forces_text(host_->variables().forces().size()), why,
               host_->variables().forced_names());
}

}  // namespace plchost
