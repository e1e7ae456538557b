#include "tests/integration/security/packets.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <arpa/inet.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <netinet/ip.h>
#include <netinet/udp.h>
#include <sys/socket.h>

namespace plchost {

namespace {

// As DDS has it: of the participant with index 0, for discovery; the next one is for data.
std::uint16_t first_port_of(std::uint32_t domain) {
  return static_cast<std::uint16_t>(7400 + 250 * domain + 10);
}

bool is_for(const std::byte* packet, std::size_t size, std::uint16_t first_port, std::size_t& begin) {
  iphdr ip{};
  udphdr udp{};
  if (size < sizeof ip) return false;
  std::memcpy(&ip, packet, sizeof ip);
  const std::size_t header = std::size_t{ip.ihl} * 4;
  if (ip.protocol != IPPROTO_UDP || size < header + sizeof udp) return false;
  std::memcpy(&udp, packet + header, sizeof udp);
  const std::uint16_t port = ntohs(udp.dest);
  begin = header + sizeof udp;
  return port == first_port || port == first_port + 1;
}

}  // namespace

Result<PacketCapture> PacketCapture::open(std::uint32_t domain) {
  UniqueFd fd(::socket(AF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, htons(ETH_P_IP)));
  if (!fd) return failure(ErrorCode::refused, "look at packets", errno);
  constexpr int kBuffer = 64 << 20;
  (void)::setsockopt(fd.get(), SOL_SOCKET, SO_RCVBUFFORCE, &kBuffer, sizeof kBuffer);
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(ETH_P_IP);
  address.sll_ifindex = static_cast<int>(::if_nametoindex("lo"));
  if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return failure(ErrorCode::system, "look at packets of lo", errno);
  }
  return PacketCapture(std::move(fd), first_port_of(domain));
}

std::vector<Packet> PacketCapture::take() {
  std::vector<Packet> packets;
  std::array<std::byte, 65536> buffer;
  for (;;) {
    sockaddr_ll from{};
    socklen_t size = sizeof from;
    const ssize_t got =
        ::recvfrom(fd_.get(), buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    if (got < 0) break;
    std::size_t begin = 0;
    // Each passes lo twice: as it goes out and as it comes in.
    if (from.sll_pkttype != PACKET_HOST ||
        !is_for(buffer.data(), static_cast<std::size_t>(got), first_port_, begin)) {
      continue;
    }
    packets.emplace_back(buffer.begin() + static_cast<std::ptrdiff_t>(begin), buffer.begin() + got);
  }
  if (packets.size() > kMost) packets.erase(packets.begin(), packets.end() - kMost);
  return packets;
}

PacketSender::PacketSender(std::uint32_t domain)
    : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)), first_port_(first_port_of(domain)) {}

void PacketSender::send(const std::vector<Packet>& packets) const {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  for (std::uint16_t port = first_port_; port <= first_port_ + 1; ++port) {
    address.sin_port = htons(port);
    for (const Packet& packet : packets) {
      (void)::sendto(fd_.get(), packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&address),
                     sizeof address);
    }
  }
}

Packet mutated(const std::vector<Packet>& packets, std::mt19937& random) {
  const auto below = [&](std::size_t most) {
    return std::uniform_int_distribution<std::size_t>(0, most - 1)(random);
  };
  Packet packet = packets[below(packets.size())];
  // Mostly behind the first word, or it is no RTPS and looked at no further.
  constexpr std::size_t kMagic = 4;
  const std::size_t kind = below(8);
  if (packet.size() <= kMagic + 4) return packet;
  if (kind == 0) packet.resize(kMagic + below(packet.size() - kMagic));
  if (kind == 1) {
    const Packet& other = packets[below(packets.size())];
    const std::size_t from = below(other.size());
    const std::size_t to = kMagic + below(packet.size() - kMagic);
    const std::size_t size = std::min({other.size() - from, packet.size() - to, std::size_t{1} + below(64)});
    std::copy_n(other.begin() + static_cast<std::ptrdiff_t>(from), size,
                packet.begin() + static_cast<std::ptrdiff_t>(to));
  }
  if (kind == 2) {
    constexpr std::array kEdges{std::byte{0x00}, std::byte{0x7f}, std::byte{0x80}, std::byte{0xff}};
    const std::size_t to = kMagic + below(packet.size() - kMagic - 3);
    std::fill_n(packet.begin() + static_cast<std::ptrdiff_t>(to), 1 + below(4), kEdges[below(kEdges.size())]);
  }
  const std::size_t flips = kind < 3 ? below(2) : 1 + below(6);
  for (std::size_t i = 0; i < flips && packet.size() > kMagic; ++i) {
    packet[kMagic + below(packet.size() - kMagic)] = static_cast<std::byte>(below(256));
  }
  return packet;
}

}  // namespace plchost
