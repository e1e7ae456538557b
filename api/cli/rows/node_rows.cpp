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
  static const std::vector<Column> columns{
      {"host", "HOST"},         {"node", "NODE"},           {"name", "NAME"},
      {"pid", "PID"},           {"base", "BASE"},           {"forwards", "FORWARDS"},
      {"queue_slots", "SLOTS"}, {"hosts", "HOSTS"},         {"arrivals", "ARRIVED"},
      {"forwarded", "CARRIED"}, {"congested", "CONGESTED"}, {"expired", "EXPIRED"},
      {"no_route", "NO ROUTE"}, {"loops", "LOOPS"},         {"lost", "LOST"}};
  return columns;
}

const std::vector<Column>& route_columns() {
  static const std::vector<Column> columns{
      {"host", "HOST"},         {"from", "FROM"},        {"from_name", "NAME"},  {"to", "TO"},
      {"to_name", "NAME"},      {"to_hosts", "HOSTS"},   {"next_hop", "NEXT"},   {"links", "LINKS"},
      {"sent", "SENT"},         {"sent_bytes", "BYTES"}, {"waiting", "WAITING"}, {"congested", "CONGESTED"},
      {"received", "RECEIVED"}, {"damaged", "DAMAGED"},  {"expired", "EXPIRED"}};
  return columns;
}

}  // namespace plchost
