#pragma once

#include <string>
#include <string_view>

#include "instances/launch/launch_contract.hpp"
#include "shm/base/result.hpp"
#include "shm/sockets/packet_socket.hpp"

namespace plchost {

/// Tells the starter of this instance how its set-up goes: the manager by packets, a person by log lines.
class SetupReporter {
 public:
  /// `report_fd`: a SEQPACKET socket, owned from here on; -1: the log.
  explicit SetupReporter(int report_fd);

  /// The step is done; `remark`, if not empty, is what the operator should know about it.
  void done(SetupStep step, std::string_view remark = {});
  /// The step failed: the last report.
  void failed(SetupStep step, const Error& error);

 private:
  void report(const SetupReport& report);
  PacketSocket socket_;
};

}  // namespace plchost
