#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

using Packet = std::vector<std::byte>;

/// Sees all UDP packets of the loopback device that go to the ports of a host's API server.
class PacketCapture {
 public:
  /// Of the first server of the domain on this machine. refused: this process may not look at packets.
  [[nodiscard]] static Result<PacketCapture> open(std::uint32_t domain);

  /// The packets since the last call, the newest kMost of them.
  [[nodiscard]] std::vector<Packet> take();
  static constexpr std::size_t kMost = 4096;

 private:
  PacketCapture(UniqueFd fd, std::uint16_t first_port) : fd_(std::move(fd)), first_port_(first_port) {}

  UniqueFd fd_;
  std::uint16_t first_port_;
};

/// Sends to the ports of that server, from a port of its own.
class PacketSender {
 public:
  explicit PacketSender(std::uint32_t domain);
  /// To the port of discovery and to that of data, as fast as it goes.
  void send(const std::vector<Packet>& packets) const;

 private:
  UniqueFd fd_;
  std::uint16_t first_port_;
};

/// One of the packets with some bytes changed, cut, or with a part of another in it.
[[nodiscard]] Packet mutated(const std::vector<Packet>& packets, std::mt19937& random);

}  // namespace plchost
