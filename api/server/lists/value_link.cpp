#include "api/server/lists/value_link.hpp"

namespace plchost {

Result<ValueLink> ValueLink::connect(const std::string& run_directory, const std::string& instance) {
  PLCHOST_TRY_ASSIGN(auto socket, PacketSocket::connect(values_socket_path(run_directory, instance)));
  return ValueLink(std::move(socket));
}

Result<std::vector<ValueReply>> ValueLink::receive() {
  std::vector<ValueReply> replies;
  for (int i = 0; i < kAtOnce; ++i) {
    PLCHOST_TRY_ASSIGN(const auto packet, socket_.receive());
    if (!packet) break;
    PLCHOST_TRY_ASSIGN(auto reply, reader_.take(*packet));
    if (reply) replies.push_back(*std::move(reply));
  }
  return replies;
}

}  // namespace plchost
