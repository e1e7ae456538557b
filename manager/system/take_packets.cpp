#include "manager/system/take_packets.hpp"

namespace plchost {

void take_packets(PacketSocket& link, Reactor::Watch& watch,
                  const std::function<void(std::string_view)>& take) {
  while (link) {
    const auto packet = link.receive();
    if (packet && !*packet) return;
    if (packet) {
      take(**packet);
      continue;
    }
    watch.reset();
    link.close();
  }
}

}  // namespace plchost
