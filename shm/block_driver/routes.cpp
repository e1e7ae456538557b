#include "shm/block_driver/routes.hpp"

#include <algorithm>
#include <map>
#include <tuple>

namespace plchost {

namespace {

std::uint64_t value_of(const std::atomic<std::uint64_t>& counter) noexcept {
  return counter.load(std::memory_order_relaxed);
}

NodeInfo info_of(const NodeSlot& slot, std::uint16_t node, const NodeRecord& record) {
  const NodeCounters& counters = slot.counters;
  return {.node = node,
          .record = record,
          .arrivals = slot.arrivals.count(),
          .forwarded = value_of(counters.forwarded),
          .no_route = value_of(counters.no_route),
          .loops = value_of(counters.loops),
          .duplicates = value_of(counters.duplicates),
          .congested = value_of(counters.congested),
          .expired = value_of(counters.expired),
          .unconnected = value_of(counters.unconnected),
          .refused = value_of(counters.refused),
          .lost = value_of(counters.lost)};
}

}  // namespace

Topology topology_of(const NodeDirectory& directory) {
  Topology topology;
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    const auto record = directory.record(node);
    if (!record) continue;
    NodeSet talks_to;
    for (std::size_t bit = 0; bit < kMaxNodes; ++bit) {
      const std::uint64_t word = directory.slot(node).neighbours[bit / 64].load(std::memory_order_acquire);
      talks_to.set(bit, (word >> (bit % 64) & 1) != 0);
    }
    topology.add(node, talks_to, record->forwards != 0);
  }
  return topology;
}

std::vector<HostRoute> host_routes(const NodeDirectory& directory, const Topology& topology,
                                   std::uint16_t from) {
  const auto distances = topology.distances(from);
  const auto hops = topology.next_hops(from);
  std::vector<HostRoute> routes;
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    const bool reached = node == from || distances[node - 1U] != 0;
    const auto record = reached ? directory.record(node) : std::nullopt;
    if (!record) continue;
    for (const HostRange& hosts : record->hosts) {
      if (hosts.first == 0 || hosts.last < hosts.first) continue;
      // A gateway gives its own blocks for others to its router, which lies behind its link to itself.
      routes.push_back({.hosts = hosts,
                        .gateway = node,
                        .next_hop = node == from ? node : hops[node - 1U],
                        .links = distances[node - 1U]});
    }
  }
  std::ranges::sort(routes, {}, [](const HostRoute& route) {
    return std::tuple(route.links, route.gateway, route.hosts.first);
  });
  if (routes.size() > kMaxHostRoutes) routes.resize(kMaxHostRoutes);
  return routes;
}

std::vector<NodeInfo> list_nodes(const NodeDirectory& directory) {
  std::vector<NodeInfo> nodes;
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    if (const auto record = directory.record(node)) {
      nodes.push_back(info_of(directory.slot(node), node, *record));
    }
  }
  return nodes;
}

std::vector<RouteInfo> routes_from(const NodeDirectory& directory, const Topology& topology,
                                   std::uint16_t from) {
  const auto hops = topology.next_hops(from);
  const auto distances = topology.distances(from);
  std::vector<RouteInfo> routes;
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    if (node == from || distances[node - 1U] == 0) continue;
    routes.push_back({.from = from,
                      .to = node,
                      .hosts = {},
                      .next_hop = hops[node - 1U],
                      .links = distances[node - 1U],
                      .first = std::nullopt});
  }
  for (const HostRoute& route : host_routes(directory, topology, from)) {
    routes.push_back({.from = from,
                      .to = route.gateway,
                      .hosts = route.hosts,
                      .next_hop = route.next_hop,
                      .links = route.links,
                      .first = std::nullopt});
  }
  std::map<std::uint16_t, std::optional<LinkCounts>> links;
  for (RouteInfo& route : routes) {
    const auto [known, is_new] = links.try_emplace(route.next_hop);
    if (is_new) {
      const auto link = LinkMemory::open_to_read(directory.link(from, route.next_hop));
      if (link) known->second = link->counts();
    }
    route.first = known->second;
  }
  return routes;
}

}  // namespace plchost
