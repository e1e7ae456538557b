#include "instances/runtime/instance/instance_socket.hpp"

#include <utility>

#include <fmt/format.h>

namespace plchost {

Result<InstanceSocket> InstanceSocket::listen(const std::string& path, Handler handler) {
  PLCHOST_TRY_ASSIGN(auto server,
                     PacketServer::listen(
                         {.path = path,
                          .most = kMaxConnections,
                          .full = encode(ControlReply{
                              .number = 0,
                              .code = ErrorCode::busy,
                              .text = fmt::format("{} control connections are open, that is all there may be",
                                                  kMaxConnections)})}));
  return InstanceSocket(std::move(server), std::move(handler));
}

bool InstanceSocket::send(std::uint64_t connection, const ControlReply& reply) {
  const std::string packet = encode(reply);
  return server_.send(connection, std::span(&packet, 1));
}

void InstanceSocket::answer(const Asker& asker, ControlReply reply) {
  reply.number = asker.number;
  (void)send(asker.connection, reply);
}

bool InstanceSocket::take(std::uint64_t connection, const Result<std::string>& packet) {
  const auto refuse = [&](std::uint64_t number, ErrorCode code, std::string text) {
    return send(connection, ControlReply{.number = number, .code = code, .text = std::move(text)});
  };
  if (!packet) return refuse(0, packet.error().code, packet.error().describe());
  const auto request = decode_request(*packet);
  if (!request) return refuse(0, request.error().code, request.error().describe());
  if (const auto in_time = check_in_time(request->limit_ns); !in_time)
    return refuse(request->number, in_time.error().code, in_time.error().message);
  auto reply = handler_(*request, Asker{.connection = connection, .number = request->number});
  if (!reply) return true;
  reply->number = request->number;
  return send(connection, *reply);
}

void InstanceSocket::serve() {
  server_.serve([this](std::uint64_t connection, const Result<std::string>& packet) {
    return take(connection, packet);
  });
}

}  // namespace plchost
