#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/bench/bench.hpp"
#include "tests/bench/child.hpp"
#include "tests/bench/fleet_network.hpp"

namespace plchost::bench {

/// The DDS domain of the fleet. Its network is its own, so no other domain meets it.
inline constexpr int kFleetDomain = 0;

/// "h1" is host 0.
[[nodiscard]] std::string fleet_host_name(int number);

/// plchostd on each host of a network, without instances. All end, and their files go, with this object.
class FleetHosts {
 public:
  /// `folder`: for their configurations and run directories. `pools`: their names begin with it.
  FleetHosts(std::filesystem::path folder, std::string pools)
      : folder_(std::move(folder)), pools_(std::move(pools)) {}
  FleetHosts(const FleetHosts&) = delete;
  FleetHosts& operator=(const FleetHosts&) = delete;
  ~FleetHosts();

  /// One host after the other. All of them run on the machine of the benchmark. It would be too busy for the
  /// leases of DDS if they began together.
  [[nodiscard]] Result<void> start(const Plan& plan, const FleetNetwork& network, int hosts);

 private:
  [[nodiscard]] std::string configure(const Plan& plan, int number) const;

  std::filesystem::path folder_;
  std::string pools_;
  std::vector<Child> managers_;
};

}  // namespace plchost::bench
