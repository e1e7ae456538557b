#include "tests/bench/fleet_network.hpp"

#include <cstddef>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "tests/bench/child.hpp"

namespace plchost::bench {

namespace {

std::string ip_address(std::size_t machine) {
  return fmt::format("10.79.0.{}", machine + 1);
}

std::string ethernet_address(std::size_t machine) {
  return fmt::format("02:00:0a:4f:00:{:02x}", machine + 1);
}

/// For `ip -batch`: the switch's end of the cable is "port0", "port1" ...
std::string plug_in(std::size_t machine, std::size_t machines, const NetworkSpace& bridge) {
  std::string script = fmt::format(
      "link set lo up\n"
      "link add name {0} address {1} type veth peer name port{2} netns {3}\n"
      "address add {4}/24 dev {0}\n"
      "link set {0} up\n",
      kCable, ethernet_address(machine), machine, bridge.path(), ip_address(machine));
  for (std::size_t other = 0; other < machines; ++other) {
    if (other == machine) continue;
    script += fmt::format("neighbour add {} lladdr {} dev {} nud permanent\n", ip_address(other),
                          ethernet_address(other), kCable);
  }
  return script;
}

std::string connect_ports(std::size_t machines) {
  std::string script = "link add name bridge type bridge\nlink set bridge up\n";
  for (std::size_t machine = 0; machine < machines; ++machine)
    script += fmt::format("link set port{0} master bridge\nlink set port{0} up\n", machine);
  return script;
}

Result<void> run_ip(const NetworkSpace& space, const std::filesystem::path& folder,
                    const std::string& script) {
  const auto path = folder / "network";
  std::ofstream(path) << script;
  PLCHOST_TRY_ASSIGN(const auto visit, space.enter());
  PLCHOST_TRY_ASSIGN(auto ip, Child::start({"ip", "-batch", path.string()}));
  if (auto done = ip.wait(); !done) return failure_in("ip -batch", std::move(done.error()));
  return {};
}

}  // namespace

Result<FleetNetwork> FleetNetwork::create(int hosts, const std::filesystem::path& folder) {
  PLCHOST_TRY_ASSIGN(auto bridge, NetworkSpace::create());
  FleetNetwork network(std::move(bridge));
  const auto machines = static_cast<std::size_t>(hosts) + 1;  // and the desk
  for (std::size_t machine = 0; machine < machines; ++machine) {
    PLCHOST_TRY_ASSIGN(auto space, NetworkSpace::create());
    PLCHOST_TRY(run_ip(space, folder, plug_in(machine, machines, network.switch_)));
    network.machines_.push_back(std::move(space));
  }
  PLCHOST_TRY(run_ip(network.switch_, folder, connect_ports(machines)));
  return network;
}

}  // namespace plchost::bench
