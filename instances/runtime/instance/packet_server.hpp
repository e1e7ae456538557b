#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/sockets/packet_socket.hpp"

namespace plchost {

/// A socket of the instance: any number of connections up to a bound, none able to block another. A client
/// that does not read is dropped. Packets that were not taken before their client closed the connection are
/// void. Control thread.
class PacketServer {
 public:
  /// Together they have at most so many connections, for which descriptors are kept free.
  static constexpr std::size_t kMostOfAll = 32;

  struct Options {
    std::string path;
    std::size_t most = 0;  ///< connections
    std::string full;      ///< the packet for one that is too many
  };
  [[nodiscard]] static Result<PacketServer> listen(Options options);

  /// Readable when serve() has something to do.
  [[nodiscard]] int fd() const noexcept { return epoll_.get(); }
  /// Gets a packet; corrupt: it was too large. False: the connection is over.
  using Take = std::function<bool(std::uint64_t connection, Result<std::string> packet)>;
  /// Takes new connections, and at most one packet of each connection.
  void serve(const Take& take);
  /// Takes the connections that could not be taken yet. To be called every 100 ms.
  void beat();
  /// Nobody gets it if the connection is gone. Also within serve(), for any connection. False: it is over.
  bool send(std::uint64_t connection, std::span<const std::string> packets);

 private:
  PacketServer(PacketListener listener, UniqueFd epoll, Options options)
      : listener_(std::move(listener)), epoll_(std::move(epoll)), options_(std::move(options)) {}

  struct Connection {
    std::uint64_t id = 0;  // descriptors are used again, these are not
    PacketSocket socket;
  };

  [[nodiscard]] Result<std::optional<PacketSocket>> accept();
  void accept_all();
  [[nodiscard]] bool serve_one(Connection& connection, const Take& take);

  PacketListener listener_;
  UniqueFd epoll_;
  Options options_;
  std::map<int, Connection> connections_;  // by descriptor
  std::uint64_t next_id_ = 1;
  std::uint64_t serving_ = 0;  // the connection whose packet is worked on; 0: none
  bool serving_over_ = false;  // it is to be closed
  bool waiting_ = false;       // connections may be left that were not taken
};

}  // namespace plchost
