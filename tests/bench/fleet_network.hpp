#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "tests/bench/network_space.hpp"

namespace plchost::bench {

/// The name of the interface of each machine.
inline constexpr std::string_view kCable = "cable";

/// One switch, and on it a number of hosts and a desk: each a network namespace with an address of its own.
/// The switch floods multicast, as a plant's does without snooping.
///
/// All machines know the Ethernet addresses of the others from the start. The kernel has one table of
/// neighbours for all namespaces, and by default it holds 1,024 that were learned: 64 hosts would need 4,160.
class FleetNetwork {
 public:
  /// `folder`: for the scripts of `ip`. refused: this process may make no namespaces.
  [[nodiscard]] static Result<FleetNetwork> create(int hosts, const std::filesystem::path& folder);

  [[nodiscard]] const NetworkSpace& host(int number) const {
    return machines_[static_cast<std::size_t>(number)];
  }
  [[nodiscard]] const NetworkSpace& desk() const { return machines_.back(); }

 private:
  explicit FleetNetwork(NetworkSpace bridge) : switch_(std::move(bridge)) {}
  NetworkSpace switch_;
  std::vector<NetworkSpace> machines_;
};

}  // namespace plchost::bench
