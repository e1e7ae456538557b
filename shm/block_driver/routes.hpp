#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "shm/block_driver/block_link.hpp"
#include "shm/block_driver/node_directory.hpp"
#include "shm/block_driver/topology.hpp"

namespace plchost {

/// The connections between nodes, as the directory says at present. Soft threads.
[[nodiscard]] Topology topology_of(const NodeDirectory& directory);

/// The way to other hosts.
struct HostRoute {
  HostRange hosts;
  std::uint16_t gateway = 0;   ///< the node through which they are reached
  std::uint16_t next_hop = 0;  ///< on the way to it; the gateway's own: itself
  std::uint8_t links = 0;      ///< to the gateway
};
/// The nearest gateways first. Soft threads.
[[nodiscard]] std::vector<HostRoute> host_routes(const NodeDirectory& directory, const Topology& topology,
                                                 std::uint16_t from);

/// A node as it is seen from outside.
struct NodeInfo {
  std::uint16_t node = 0;
  NodeRecord record;
  std::uint64_t arrivals = 0;  ///< blocks that were sent to it over links of its own
  // Its counts, see NodeCounters.
  std::uint64_t forwarded = 0;
  std::uint64_t no_route = 0;
  std::uint64_t loops = 0;
  std::uint64_t duplicates = 0;
  std::uint64_t congested = 0;
  std::uint64_t expired = 0;
  std::uint64_t unconnected = 0;
  std::uint64_t refused = 0;
  std::uint64_t lost = 0;
};
/// All nodes that there are, by address. Soft threads.
[[nodiscard]] std::vector<NodeInfo> list_nodes(const NodeDirectory& directory);

/// How blocks go from one node to another, or to other hosts.
struct RouteInfo {
  std::uint16_t from = 0;
  std::uint16_t to = 0;  ///< of hosts: the gateway
  HostRange hosts;       ///< first 0: it is a way to the node `to` itself
  std::uint16_t next_hop = 0;
  std::uint8_t links = 0;           ///< to `to`
  std::optional<LinkCounts> first;  ///< of the link to next_hop, if it has been made
};
/// The most ways that a node can have: to each other one, and to all ranges of all gateways that it uses.
inline constexpr std::size_t kMaxHostRoutes = 32;
inline constexpr std::size_t kMaxRoutes = kMaxNodes + kMaxHostRoutes;
/// All ways that a node has, at most kMaxRoutes. Soft threads; opens each link to look at it.
[[nodiscard]] std::vector<RouteInfo> routes_from(const NodeDirectory& directory, const Topology& topology,
                                                 std::uint16_t from);

}  // namespace plchost
