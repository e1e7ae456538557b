#include "api/library/call_order.hpp"

#include "api/library/calls.hpp"

namespace plchost {

std::unexpected<Error> client_has_ended() {
  return failure(ErrorCode::unavailable, "the client has ended");
}

Async<Result<CallOrder::Place>> CallOrder::place(ClientCore& core, std::string name) {
  Place found;
  PLCHOST_CO_TRY_ASSIGN(found.host, co_await host_of(core, name, deadline()));
  found.turn = std::make_unique<Turns::Turn>(turns_[found.host], core.pump());
  while (!found.turn->has_come()) co_await core.pump().change(kNoDeadline);
  if (ended_.load()) co_return client_has_ended();
  found.deadline = deadline();
  co_return std::move(found);
}

}  // namespace plchost
