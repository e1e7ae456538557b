#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/sockets/packet_socket.hpp"
#include "shm/variables/value_message.hpp"

namespace plchost {

/// The connection to the values socket of one instance. Never waits. Control loop only.
class ValueLink {
 public:
  /// unavailable: no process of the instance listens there.
  [[nodiscard]] static Result<ValueLink> connect(const std::string& run_directory,
                                                 const std::string& instance);

  [[nodiscard]] int fd() const noexcept { return socket_.fd(); }
  /// busy: the instance does not read. unavailable: its process has ended.
  [[nodiscard]] Result<void> send(const ValueRequest& request) { return socket_.send(encode(request)); }
  /// The replies that have come, at most kAtOnce packets at a time. An error: the connection is of no use any
  /// more.
  [[nodiscard]] Result<std::vector<ValueReply>> receive();
  static constexpr int kAtOnce = 32;

 private:
  explicit ValueLink(PacketSocket socket) noexcept : socket_(std::move(socket)) {}

  PacketSocket socket_;
  ValueReplyReader reader_;
};

}  // namespace plchost
