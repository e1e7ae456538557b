#pragma once

#include <functional>
#include <string_view>

#include "manager/system/reactor.hpp"
#include "shm/sockets/packet_socket.hpp"

namespace plchost {

/// Gives each packet that has come to `take`, which may close the link. If the other end is gone, the link
/// and its watch are closed after the last packet.
void take_packets(PacketSocket& link, Reactor::Watch& watch,
                  const std::function<void(std::string_view)>& take);

}  // namespace plchost
