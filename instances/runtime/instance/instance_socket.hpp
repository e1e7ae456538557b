#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "shm/base/result.hpp"
#include "shm/sockets/control_message.hpp"
#include "shm/sockets/packet_socket.hpp"

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
  [[nodiscard]] int fd() const noexcept { return epoll_.get(); }
  /// Takes new connections, and at most one request of each connection.
  void serve();
  /// Takes the connections that could not be taken yet. To be called every 100 ms.
  void beat();
  /// The reply to a request that was not answered at once. Nobody gets it if the connection is gone. The
  /// handler may call it, also for the connection whose request it works on.
  void answer(const Asker& asker, ControlReply reply);

 private:
  InstanceSocket(PacketListener listener, UniqueFd epoll, Handler handler)
      : listener_(std::move(listener)), epoll_(std::move(epoll)), handler_(std::move(handler)) {}

  struct Connection {
    std::uint64_t id = 0;  // descriptors are used again, these are not
    PacketSocket socket;
  };

  [[nodiscard]] Result<std::optional<PacketSocket>> accept();
  void accept_all();
  /// False: the connection is over.
  [[nodiscard]] bool serve_one(Connection& connection);
  [[nodiscard]] static bool send(Connection& connection, const ControlReply& reply);

  PacketListener listener_;
  UniqueFd epoll_;
  Handler handler_;
  std::map<int, Connection> connections_;  // by descriptor
  std::uint64_t next_id_ = 1;
  std::uint64_t serving_ = 0;  // the connection whose request the handler works on; 0: none
  bool serving_over_ = false;  // it is to be closed
  bool waiting_ = false;       // connections may be left that were not taken
};

}  // namespace plchost
