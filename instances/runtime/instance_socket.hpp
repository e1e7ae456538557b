#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>

#include "shm/base/control_message.hpp"
#include "shm/base/packet_socket.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The instance's control socket: any number of connections up to a bound, none able to block another. A
/// client that does not read its replies is dropped; a packet that is no request gets a reply that says why.
/// Control thread.
class InstanceSocket {
 public:
  using Handler = std::function<ControlReply(const ControlRequest&)>;
  static constexpr std::size_t kMaxConnections = 16;

  [[nodiscard]] static Result<InstanceSocket> listen(const std::string& path, Handler handler);

  /// Readable when serve() has something to do.
  [[nodiscard]] int fd() const noexcept { return epoll_.get(); }
  /// Takes new connections, and at most one request of each connection.
  void serve();

 private:
  InstanceSocket(PacketListener listener, UniqueFd epoll, Handler handler)
      : listener_(std::move(listener)), epoll_(std::move(epoll)), handler_(std::move(handler)) {}

  void accept_all();
  /// False: the connection is over.
  [[nodiscard]] bool serve_one(PacketSocket& connection);

  PacketListener listener_;
  UniqueFd epoll_;
  Handler handler_;
  std::map<int, PacketSocket> connections_;  // by descriptor
};

}  // namespace plchost
