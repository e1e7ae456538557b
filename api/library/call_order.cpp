#include "api/library/call_order.hpp"

#include "api/library/calls.hpp"
#include "shm/base/futex.hpp"

namespace plchost {

std::unexpected<Error> client_has_ended() {
  return failure(ErrorCode::unavailable, "the client has ended");
}

void CallOrder::release_first(const Line& line) {
  Turn* const first = line.begin()->second;
  if (first->has_come()) first->hold_.release();
}

CallOrder::Turn::Turn(CallOrder& order, Pump& pump, std::string host)
    : order_(order), number_(++order.last_), host_(std::move(host)), hold_(pump) {
  (host_.empty() ? order_.unknown_ : order_.lines_[host_]).emplace(number_, this);
}

CallOrder::Turn::~Turn() {
  leave();
}

void CallOrder::Turn::leave() {
  if (host_.empty()) {
    order_.unknown_.erase(number_);
    for (const auto& [host, line] : order_.lines_) release_first(line);
    return;
  }
  const auto line = order_.lines_.find(host_);
  line->second.erase(number_);
  if (line->second.empty()) {
    order_.lines_.erase(line);
  } else {
    release_first(line->second);
  }
}

void CallOrder::Turn::set_host(const std::string& host) {
  if (!host_.empty()) return;
  order_.lines_[host].emplace(number_, this);
  leave();
  host_ = host;
}

bool CallOrder::Turn::has_come() const {
  const auto line = order_.lines_.find(host_);
  const Line& unknown = order_.unknown_;
  return line != order_.lines_.end() && line->second.begin()->second == this &&
         (unknown.empty() || unknown.begin()->first > number_);
}

// Of the calls to a host that does not answer yet, only the first one looks for it: the others wait for their
// turn, as long as they would look.
Async<Result<std::string>> CallOrder::host_in_turn(ClientCore& core, std::string name, Turn& turn) {
  const TimePoint until = deadline();
  if (!name.empty()) {
    auto there = co_await host_of(core, name, MonotonicClock::now());
    if (there || there.error().code != ErrorCode::not_found) co_return there;
    while (!turn.has_come() && MonotonicClock::now() < until) co_await turn.come(until);
    if (ended_.load()) co_return client_has_ended();
  }
  co_return co_await host_of(core, name, until);
}

Async<Result<CallOrder::Place>> CallOrder::place(ClientCore& core, std::string name) {
  if (name.empty()) name = core.only();
  Place found;
  found.turn = std::make_unique<Turn>(*this, core.pump(), name);
  PLCHOST_CO_TRY_ASSIGN(found.host, co_await host_in_turn(core, name, *found.turn));
  found.turn->set_host(found.host);
  while (!found.turn->has_come()) co_await found.turn->come(kNoDeadline);
  if (ended_.load()) co_return client_has_ended();
  found.deadline = deadline();
  co_return std::move(found);
}

}  // namespace plchost
