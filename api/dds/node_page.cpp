#include "api/dds/node_page.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

static_assert(sizeof(plc_NodeRecord::name) == kMaxInstanceName + 1);
static_assert(sizeof(plc_NodePage::base) == kMaxBlockBase + 1);

Result<void> check_nodes(const NodeQuery& query) {
  if (!query.base.empty()) {
    PLCHOST_TRY(check_name("base name", query.base, kMaxBlockBase));
  }
  if (query.node.empty()) return {};
  return check_name("node", query.node, kMaxInstanceName);
}

// The counters that travel, each under the same name.
template <class To, class From>
void copy_counters(To& to, const From& from) {
  to.arrivals = from.arrivals;
  to.forwarded = from.forwarded;
  to.no_route = from.no_route;
  to.loops = from.loops;
  to.duplicates = from.duplicates;
  to.congested = from.congested;
  to.expired = from.expired;
  to.unconnected = from.unconnected;
  to.refused = from.refused;
  to.lost = from.lost;
}
template <class To, class From>
void copy_counts(To& to, const From& from) {
  to.sent = from.sent;
  to.sent_bytes = from.sent_bytes;
  to.waiting = from.waiting;
  to.congested = from.congested;
  to.received = from.received;
  to.damaged = from.damaged;
  to.expired = from.expired;
}

plc_NodeRecord sample_of(const ListedNode& listed, std::vector<plc_HostRange>& hosts) {
  const NodeInfo& info = listed.info;
  plc_NodeRecord sample{};
  sample.node = info.node;
  dds::copy_text(sample.name, info.record.name.view());
  sample.pid = info.record.process.pid;
  const bool good = is_printable_utf8(listed.program);
  dds::copy_text(sample.program, good ? cut(listed.program, sizeof sample.program - 1) : "?");
  sample.generation = info.record.generation;
  sample.forwards = info.record.forwards != 0;
  sample.queue_slots = info.record.queue_slots;
  copy_counters(sample, info);
  for (const HostRange& range : info.record.hosts) {
    if (range.first != 0) hosts.push_back({.first = range.first, .last = range.last});
  }
  dds::lend(sample.hosts, hosts);
  return sample;
}

plc_RouteRecord sample_of(const RouteInfo& route) {
  plc_RouteRecord sample{};
  sample.from_node = route.from;
  sample.to_node = route.to;
  sample.hosts = {.first = route.hosts.first, .last = route.hosts.last};
  sample.next_hop = route.next_hop;
  sample.links = route.links;
  sample.linked = route.first.has_value();
  if (route.first) copy_counts(sample, *route.first);
  return sample;
}

}  // namespace

Result<plc_ListPart> part_of(const NodeQuery& query) {
  PLCHOST_TRY(check_nodes(query));
  plc_ListPart part{};
  dds::copy_text(part.base, query.base);
  dds::copy_text(part.name, query.node);
  part.after = query.after;
  return part;
}

Result<NodeQuery> node_query_of(const plc_ListPart& part) {
  if (part.after > kMaxNodes) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("after {}: allowed are 0 to {}", part.after, kMaxNodes));
  }
  NodeQuery query{.base = std::string(dds::text_of(part.base)),
                  .node = std::string(dds::text_of(part.name)),
                  .after = static_cast<std::uint16_t>(part.after)};
  PLCHOST_TRY(check_nodes(query));
  return query;
}

NodePageSample::NodePageSample(const NodeListing& listing) {
  const std::size_t nodes = std::min<std::size_t>(listing.nodes.size(), kMaxNodes);
  hosts_.resize(nodes);
  for (std::size_t i = 0; i < nodes; ++i) nodes_.push_back(sample_of(listing.nodes[i], hosts_[i]));
  const std::size_t routes = std::min(listing.routes.size(), kPageRoutes);
  for (std::size_t i = 0; i < routes; ++i) routes_.push_back(sample_of(listing.routes[i]));
  dds::copy_text(page_.base, listing.base);
  page_.host_number = listing.host_number;
  page_.complete = listing.complete;
  page_.next_after = listing.next_after;
  dds::lend(page_.nodes, nodes_);
  dds::lend(page_.routes, routes_);
}

NodesTold listing_of(const plc_NodePage& page) {
  NodesTold told;
  told.base = dds::text_of(page.base);
  told.host_number = page.host_number;
  told.complete = page.complete;
  told.next_after = page.next_after;
  for (plc_NodeRecord node : dds::parts_of(page.nodes)) {
    const auto hosts = dds::parts_of(node.hosts);
    dds::lend(node.hosts, told.hosts.emplace_back(hosts.begin(), hosts.end()));
    told.nodes.push_back(node);
  }
  const auto routes = dds::parts_of(page.routes);
  told.routes.assign(routes.begin(), routes.end());
  return told;
}

}  // namespace plchost
