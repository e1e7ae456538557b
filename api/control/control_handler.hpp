#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "shm/sockets/control_message.hpp"

namespace plchost {

/// The manager's control socket: "RUN_DIRECTORY/manager.sock". SEQPACKET, one message in one packet:
/// ControlRequests in, one ControlReply out for each. The reply comes when the thing is done (or failed, or
/// took too long), so not in the order of the requests. A packet that is no request is answered with number 0
/// and `corrupt`.
[[nodiscard]] inline std::string manager_socket_path(std::string_view run_directory) {
  return std::string(run_directory) + "/manager.sock";
}

/// Answers one request. Called exactly once, on the thread of the handler.
using ControlReplyFunction = std::function<void(ControlReply)>;

/// Carries out control requests: the manager. Soft thread, never waits.
class ControlHandler {
 public:
  virtual ~ControlHandler() = default;
  /// Replies at once or later; `reply` may outlive the peer that asked.
  virtual void handle(const ControlRequest& request, ControlReplyFunction reply) = 0;
};

}  // namespace plchost
