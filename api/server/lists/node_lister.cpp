#include "api/server/lists/node_lister.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/process/thread_owner.hpp"

namespace plchost {

namespace {

struct Asked {
  NodeListing listing;                     // base and host number
  std::optional<NodeDirectory> directory;  // none: no node has ever joined
  std::vector<NodeInfo> nodes;
};

std::unexpected<Error> unknown_node(const std::string& name, const std::vector<NodeInfo>& nodes) {
  std::vector<std::string_view> names;
  for (const NodeInfo& node : nodes) names.push_back(node.record.name.view());
  const auto near = nearest_name(name, names);
  return failure(ErrorCode::not_found,
                 fmt::format("no node '{}'{}; there are: {}", shown(name),
                             near.empty() ? "" : fmt::format(" (did you mean '{}'?)", near),
                             names.empty() ? "none" : join_names(names)));
}

Result<Asked> look(const std::string& pool, const std::string& base, const NodeQuery& query) {
  Asked asked{.listing = {.base = base}, .directory = std::nullopt, .nodes = {}};
  PLCHOST_TRY_ASSIGN(auto directory, if_found(NodeDirectory::open_to_read(pool, base)));
  if (directory) {
    asked.listing.host_number =
        static_cast<std::uint16_t>(directory->layout().host_number.load(std::memory_order_relaxed));
    asked.nodes = list_nodes(*directory);
    asked.directory.emplace(*std::move(directory));
  }
  if (!query.node.empty()) {
    const auto address = parse_node_address(query.node);
    const auto is_it = [&](const NodeInfo& node) {
      return node.record.name.view() == query.node ||
             (address && address->host == 0 && address->node == node.node);
    };
    if (std::ranges::none_of(asked.nodes, is_it)) return unknown_node(query.node, asked.nodes);
    std::erase_if(asked.nodes, [&](const NodeInfo& node) { return !is_it(node); });
  }
  std::erase_if(asked.nodes, [&](const NodeInfo& node) { return node.node <= query.after; });
  return asked;
}

}  // namespace

Result<NodeListing> NodeLister::nodes(const NodeQuery& query) const {
  PLCHOST_TRY_ASSIGN(auto asked, look(pool_, query.base.empty() ? base_ : query.base, query));
  for (const NodeInfo& node : asked.nodes) {
    auto owner = owner_of_thread(static_cast<std::uint32_t>(node.record.process.pid));
    asked.listing.nodes.push_back({.info = node, .program = owner ? std::move(owner->program) : ""});
  }
  return std::move(asked.listing);
}

Result<NodeListing> NodeLister::routes(const NodeQuery& query, TimePoint until) const {
  PLCHOST_TRY_ASSIGN(auto asked, look(pool_, query.base.empty() ? base_ : query.base, query));
  NodeListing& listing = asked.listing;
  if (!asked.directory) return std::move(listing);
  const Topology topology = topology_of(*asked.directory);
  for (const NodeInfo& node : asked.nodes) {
    const bool first = listing.next_after == 0;
    const bool fits = listing.routes.size() + kMaxRoutes <= kPageRoutes;
    if (!first && (!fits || MonotonicClock::now() >= until)) {
      listing.complete = false;
      return std::move(listing);
    }
    const auto routes = routes_from(*asked.directory, topology, node.node);
    listing.routes.insert(listing.routes.end(), routes.begin(), routes.end());
    listing.next_after = node.node;
  }
  listing.next_after = 0;
  return std::move(listing);
}

}  // namespace plchost
