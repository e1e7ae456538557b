// packet_flood DOMAIN COUNT [SEED]: looks for a second at what clients send to a host of that domain. Then it
// sends COUNT packets made of it to that host, as fast as it goes.
#include <chrono>
#include <cstdlib>
#include <thread>

#include <fmt/format.h>

#include "tests/integration/security/packets.hpp"

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: packet_flood DOMAIN COUNT [SEED]\n");
    return 2;
  }
  const auto domain = static_cast<std::uint32_t>(std::strtoul(argv[1], nullptr, 10));
  const std::uint64_t count = std::strtoull(argv[2], nullptr, 10);
  std::mt19937 random(argc > 3 ? static_cast<std::uint32_t>(std::strtoul(argv[3], nullptr, 10)) : 1U);
  auto capture = plchost::PacketCapture::open(domain);
  if (!capture) {
    fmt::print(stderr, "packet_flood: {}\n", capture.error().describe());
    return 77;
  }
  std::vector<plchost::Packet> seen;
  for (int i = 0; i < 40 && seen.size() < plchost::PacketCapture::kMost; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    for (auto& packet : capture->take()) seen.push_back(std::move(packet));
  }
  if (seen.empty()) {
    fmt::print(stderr, "packet_flood: no client sends to domain {}\n", domain);
    return 1;
  }
  const plchost::PacketSender sender(domain);
  const auto begin = std::chrono::steady_clock::now();
  constexpr std::uint64_t kBatch = 500;
  for (std::uint64_t sent = 0; sent < count; sent += 2 * kBatch) {
    std::vector<plchost::Packet> batch(kBatch);
    for (plchost::Packet& packet : batch) packet = plchost::mutated(seen, random);
    sender.send(batch);
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  fmt::print("{} packets made of {} in {:.1f} s\n", count, seen.size(), took.count());
  return 0;
}
