#include "api/server/lists/value_link.hpp"

namespace plchost {

Result<ValueLink> ValueLink::connect(const std::string& run_directory, const std::string& instance) {
  PLCHOST_TRY_ASSIGN(auto socket, PacketSocket::connect(values_socket_path(run_directory, instance)));
  return ValueLink(std::move(socket));
}

Result<std::vector<ValueReply>> ValueLink::receive() {
  std::vector<ValueReply> replies;
  for (int i = 0; i < kAtOnce; ++i) {
    const auto packet = socket_.receive();
    if (!packet && replies.empty()) return std::unexpected(packet.error());
    if (!packet || !*packet) break;  // the next call tells of the end
    PLCHOST_TRY_ASSIGN(auto reply, reader_.take(**packet));
    if (reply && reply->number == 0) {  // about the connection, not a request
      return failure(reply->code, reply->code == ErrorCode::busy
                                      ? "other programs have all connections to its values"
                                      : "it does not understand the API server");
    }
    if (reply) replies.push_back(*std::move(reply));
  }
  return replies;
}

}  // namespace plchost
