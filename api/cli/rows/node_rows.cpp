#include "api/cli/rows/node_rows.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace plchost {

namespace {

// "2, 5-9"; empty: none.
std::string hosts_text(std::span<const HostRange> ranges) {
  std::string text;
  for (const HostRange& hosts : ranges) {
    if (hosts.first == 0) continue;
    text += fmt::format("{}{}", text.empty() ? "" : ", ", hosts.first);
    if (hosts.last != hosts.first) text += fmt::format("-{}", hosts.last);
  }
  return text;
}

std::string name_of(std::uint16_t node, const std::vector<ListedNode>& names) {
  const auto found =
      std::ranges::find_if(names, [&](const ListedNode& listed) { return listed.info.node == node; });
  return found == names.end() ? std::string() : std::string(found->info.record.name.view());
}

}  // namespace

Row to_row(std::string_view host, const NodeListing& listing, const ListedNode& node) {
  const NodeInfo& info = node.info;
  return {{"host", host},
          {"base", listing.base},
          {"host_number", listing.host_number},
          {"node", info.node},
          {"name", info.record.name.view()},
          {"pid", info.record.pid},
          {"program", node.program},
          {"generation", info.record.generation},
          {"forwards", info.record.forwards != 0},
          {"queue_slots", info.record.queue_slots},
          {"hosts", hosts_text(info.record.hosts)},
          {"arrivals", info.arrivals},
          {"forwarded", info.forwarded},
          {"no_route", info.no_route},
          {"loops", info.loops},
          {"duplicates", info.duplicates},
          {"congested", info.congested},
          {"expired", info.expired},
          {"unconnected", info.unconnected},
          {"refused", info.refused},
          {"lost", info.lost}};
}

Row to_row(std::string_view host, const NodeListing& listing, const RouteInfo& route,
           const std::vector<ListedNode>& names) {
  const bool to_hosts = route.hosts.first != 0;
  const auto count = [&](std::uint64_t LinkCounts::* field) {
    return route.first ? Row((*route.first).*field) : Row();
  };
  return {{"host", host},
          {"base", listing.base},
          {"from", route.from},
          {"from_name", name_of(route.from, names)},
          {"to", route.to},
          {"to_name", name_of(route.to, names)},
          {"to_hosts", to_hosts ? Row(hosts_text(std::span(&route.hosts, 1))) : Row()},
          {"next_hop", route.next_hop},
          {"links", route.links},
          {"linked", route.first.has_value()},
          {"sent", count(&LinkCounts::sent)},
          {"sent_bytes", count(&LinkCounts::sent_bytes)},
          {"waiting", count(&LinkCounts::waiting)},
          {"congested", count(&LinkCounts::congested)},
          {"received", count(&LinkCounts::received)},
          {"damaged", count(&LinkCounts::damaged)},
          {"expired", count(&LinkCounts::expired)}};
}

const std::vector<Column>& node_columns() {
  static const std::vector<Column> columns{{.field = "host", .header = "HOST", .rank = 1},
                                           {.field = "node", .header = "NODE"},
                                           {.field = "name", .header = "NAME"},
                                           {.field = "pid", .header = "PID", .rank = 6},
                                           {.field = "base", .header = "BASE", .rank = 8},
                                           {.field = "forwards", .header = "FORWARDS", .rank = 7},
                                           {.field = "queue_slots", .header = "SLOTS", .rank = 9},
                                           {.field = "hosts", .header = "HOSTS", .rank = 3},
                                           {.field = "arrivals", .header = "ARRIVED"},
                                           {.field = "forwarded", .header = "CARRIED", .rank = 4},
                                           {.field = "congested", .header = "CONGESTED", .rank = 2},
                                           {.field = "expired", .header = "EXPIRED", .rank = 2},
                                           {.field = "no_route", .header = "NO ROUTE", .rank = 3},
                                           {.field = "loops", .header = "LOOPS", .rank = 5},
                                           {.field = "lost", .header = "LOST"}};
  return columns;
}

const std::vector<Column>& route_columns() {
  static const std::vector<Column> columns{{.field = "host", .header = "HOST", .rank = 1},
                                           {.field = "from", .header = "FROM"},
                                           {.field = "from_name", .header = "NAME", .rank = 3},
                                           {.field = "to", .header = "TO"},
                                           {.field = "to_name", .header = "NAME", .rank = 3},
                                           {.field = "to_hosts", .header = "HOSTS", .rank = 6},
                                           {.field = "next_hop", .header = "NEXT"},
                                           {.field = "links", .header = "LINKS", .rank = 7},
                                           {.field = "sent", .header = "SENT"},
                                           {.field = "sent_bytes", .header = "BYTES", .rank = 8},
                                           {.field = "waiting", .header = "WAITING", .rank = 1},
                                           {.field = "congested", .header = "CONGESTED", .rank = 2},
                                           {.field = "received", .header = "RECEIVED", .rank = 4},
                                           {.field = "damaged", .header = "DAMAGED", .rank = 5},
                                           {.field = "expired", .header = "EXPIRED", .rank = 5}};
  return columns;
}

}  // namespace plchost
