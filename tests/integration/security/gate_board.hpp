#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace plchost {

/// The memory that the program gated_cyclone shares with the test that feeds it.
struct GateBoard {
  struct Seed {
    std::uint32_t size = 0;
    std::array<std::byte, 4096> bytes{};
  };
  static constexpr std::size_t kSeeds = 512;

  std::atomic<std::uint16_t> feeder_port{0};
  std::atomic<bool> ready{false};      ///< all seeds are there
  std::atomic<std::uint64_t> done{0};  ///< datagrams of the feeder that the receiving thread has left behind
  std::atomic<std::uint64_t> passed{0};  ///< of them, those that the gate let pass
  std::atomic<std::uint32_t> seed_count{0};
  std::array<Seed, kSeeds> seeds{};  ///< the packets that a client has really sent
};

}  // namespace plchost
