#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "instances/runtime/instance/packet_server.hpp"
#include "shm/base/result.hpp"
#include "shm/sockets/control_message.hpp"

namespace plchost {

/// The instance's control socket: any number of connections up to a bound, none able to block another. A
/// client that does not read its replies is dropped; a packet that is no request gets a reply that says why.
/// Replies may come at once or later. Control thread.
class InstanceSocket {
 public:
  /// A request and its sender.
  struct Asker {
    std::uint64_t connection = 0;
    std::uint64_t number = 0;  ///< of the request
  };
  /// The reply; nothing: it follows by answer().
  using Handler = std::function<std::optional<ControlReply>(const ControlRequest&, const Asker&)>;
  static constexpr std::size_t kMaxConnections = 16;

  [[nodiscard]] static Result<InstanceSocket> listen(const std::string& path, Handler handler);

  /// Readable when serve() has something to do.
  [[nodiscard]] int fd() const noexcept { return server_.fd(); }
  /// Takes new connections, and at most one request of each connection.
  void serve();
  /// Takes the connections that could not be taken yet. To be called every 100 ms.
  void beat() { server_.beat(); }
  /// The reply to a request that was not answered at once. Nobody gets it if the connection is gone. The
  /// handler may call it, also for the connection whose request it works on.
  void answer(const Asker& asker, ControlReply reply);

 private:
  InstanceSocket(PacketServer server, Handler handler)
      : server_(std::move(server)), handler_(std::move(handler)) {}

  // False: the connection is over.
  [[nodiscard]] bool take(std::uint64_t connection, const Result<std::string>& packet);
  bool send(std::uint64_t connection, const ControlReply& reply);

  PacketServer server_;
  Handler handler_;
};

}  // namespace plchost
