#include "instances/runtime/instance/value_server.hpp"

#include <algorithm>
#include <utility>

namespace plchost {

Result<ValueServer> ValueServer::listen(const std::string& path, const VariableService& variables) {
  const auto full = encode(ValueReply{.number = 0, .code = ErrorCode::busy});
  PLCHOST_TRY_ASSIGN(auto server,
                     PacketServer::listen({.path = path, .most = kMaxConnections, .full = full.front()}));
  return ValueServer(std::move(server), variables);
}

void ValueServer::refuse(std::uint64_t connection, std::uint64_t number, ErrorCode code) {
  (void)server_.send(connection, encode(ValueReply{.number = number, .code = code}));
}

void ValueServer::serve() {
  server_.serve([this](std::uint64_t connection, const Result<std::string>& packet) {
    return take(connection, packet);
  });
}

bool ValueServer::take(std::uint64_t connection, const Result<std::string>& packet) {
  auto request = packet ? decode_value_request(*packet) : Result<ValueRequest>(std::unexpect, packet.error());
  const bool asks_twice = std::ranges::find(waiting_, connection, &Waiting::connection) != waiting_.end();
  if (!request || asks_twice) {
    refuse(connection, request ? request->number : 0, request ? ErrorCode::busy : ErrorCode::corrupt);
    std::erase_if(waiting_, [&](const Waiting& one) { return one.connection == connection; });
    return false;
  }
  waiting_.push_back({.connection = connection,
                      .request = *std::move(request),
                      .limit = MonotonicClock::now() + kSampleLimit});
  return true;
}

// Those that need no sample are answered. Memory for the others is there before any task is held up.
void ValueServer::prepare() {
  std::erase_if(waiting_, [&](Waiting& one) {
    const bool needs_sample = one.request.kind == ValueKind::current;
    auto plan = variables_->plan(one.request);
    if (!plan) {
      refuse(one.connection, one.request.number, plan.error().code);
      return true;
    }
    if (!needs_sample) {
      ValueReply reply = variables_->forced_values();
      reply.number = one.request.number;
      reply.time_unix_ns = unix_time_ns();
      reply.time_monotonic_ns = MonotonicClock::now().time_since_epoch().count();
      (void)server_.send(one.connection, encode(reply));
    } else {
      one.plan = *std::move(plan);
      one.reply = {.number = one.request.number, .elements = one.request.elements};
      one.reply.forced = variables_->marks(one.request.elements);
      one.reply.values.resize(one.plan.bytes);
    }
    return !needs_sample;
  });
}

void ValueServer::sample(bool consistent) noexcept {
  const std::int64_t unix_ns = unix_time_ns();
  const std::int64_t monotonic_ns = MonotonicClock::now().time_since_epoch().count();
  for (Waiting& one : waiting_) {
    one.reply.consistent = consistent;
    one.reply.time_unix_ns = unix_ns;
    one.reply.time_monotonic_ns = monotonic_ns;
    VariableService::copy(one.plan, one.reply.values);
  }
}

void ValueServer::advance(const Moment& moment, bool later) {
  const TimePoint now = MonotonicClock::now();
  if (waiting_.empty() || now < next_) return;
  prepare();
  if (waiting_.empty()) return;
  if (!moment([this] { sample(true); })) {
    const bool over =
        !later || std::ranges::any_of(waiting_, [&](const Waiting& one) { return now >= one.limit; });
    if (!over) return;
    sample(false);
  }
  next_ = MonotonicClock::now() + kPause;
  for (const Waiting& one : std::exchange(waiting_, {}))
    (void)server_.send(one.connection, encode(one.reply));
}

}  // namespace plchost
