#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "api/control/control_handler.hpp"
#include "manager/control/known_requests.hpp"
#include "manager/system/reactor.hpp"
#include "shm/sockets/packet_socket.hpp"

namespace plchost {

/// Bounds of the control socket. A client that goes beyond one is answered or disconnected; other clients do
/// not notice.
inline constexpr std::size_t kMaxConnections = 16;
inline constexpr std::size_t kMaxPendingRequests = 64;  ///< of one connection; more: busy
inline constexpr std::size_t kMaxUnreadReplies = 256;  ///< of one connection that does not read; more: closed
inline constexpr int kMaxBadPackets = 8;               ///< of one connection; more: closed

/// The manager's control socket: takes requests from any number of peers to the handler, and the replies
/// back.
class CommandServer {
 public:
  [[nodiscard]] static Result<std::unique_ptr<CommandServer>> open(Reactor& reactor, const std::string& path,
                                                                   ControlHandler& handler);
  /// A request is not answered yet, or its answer is not sent.
  [[nodiscard]] bool waits_for_answers() const noexcept;
  CommandServer(const CommandServer&) = delete;
  CommandServer& operator=(const CommandServer&) = delete;

 private:
  struct Connection {
    PacketSocket socket;
    Reactor::Watch watch;
    std::deque<std::string> unsent;
    std::size_t pending = 0;
    int bad_packets = 0;
  };

  CommandServer(Reactor& reactor, PacketListener listener, ControlHandler& handler);
  void accept();
  void on_ready(std::uint64_t id, std::uint32_t epoll_events);
  void take_packet(std::uint64_t id, std::string_view packet);
  void begin(Connection& connection, const ControlRequest& request, KnownRequests::Asker asker);
  void answer(std::uint64_t id, const ControlReply& reply);
  void answer(const std::vector<KnownRequests::Asker>& askers, ControlReply reply);
  [[nodiscard]] bool flush(Connection& connection);
  void close(std::uint64_t id, std::string_view why);
  [[nodiscard]] Connection* find(std::uint64_t id);

  Reactor& reactor_;
  PacketListener listener_;
  ControlHandler& handler_;
  Reactor::Watch listen_watch_;
  Reactor::Timer accept_again_;
  std::map<std::uint64_t, Connection> connections_;
  std::uint64_t next_id_ = 1;
  KnownRequests known_;
};

}  // namespace plchost
