#include "api/cli/rows/node_rows.hpp"

#include <gmock/gmock.h>

namespace plchost {
namespace {

NodesTold told_by(const NodeListing& listing) {
  NodePageSample sample(listing);
  return listing_of(sample.page());
}

NodesTold two_nodes() {
  NodeListing listing{.base = "blocks", .host_number = 3};
  for (const std::uint16_t address : {std::uint16_t{1}, std::uint16_t{2}}) {
    ListedNode& node = listing.nodes.emplace_back();
    node.info.node = address;
    node.info.record.name.assign(address == 1 ? "gateway" : "packer");
    node.info.record.process.pid = 4711;
    node.program = "plc-instance";
    node.info.record.generation = 7;
    node.info.record.forwards = 1;
    node.info.record.queue_slots = 256;
    node.info.arrivals = 12;
    node.info.lost = 5;
  }
  listing.nodes[0].info.record.hosts[0] = {.first = 2, .last = 2};
  listing.nodes[0].info.record.hosts[1] = {.first = 5, .last = 9};
  return told_by(listing);
}

NodesTold routes_of(const RouteInfo& route) {
  return told_by({.base = "blocks", .host_number = 3, .nodes = {}, .routes = {route}});
}

TEST(RowOfANode, HasTheFieldsThatProgramsWerePromised) {
  const NodesTold told = two_nodes();
  EXPECT_EQ(to_row(told.nodes[0].record(), std::string_view("north"), told).dump(),
            R"({"host":"north","base":"blocks","host_number":3,"node":1,"name":"gateway","pid":4711,)"
            R"("program":"plc-instance","generation":7,"forwards":true,"queue_slots":256,"hosts":"2, 5-9",)"
            R"("arrivals":12,"forwarded":0,"no_route":0,"loops":0,"duplicates":0,"congested":0,"expired":0,)"
            R"("unconnected":0,"refused":0,"lost":5})");
  EXPECT_EQ(to_row(told.nodes[1].record(), std::string_view("north"), told)["hosts"], "");
}

TEST(RowOfARoute, HasTheFieldsThatProgramsWerePromised) {
  const NodesTold names = two_nodes();
  const NodesTold told = routes_of({.from = 2,
                                    .to = 1,
                                    .hosts = {.first = 5, .last = 9},
                                    .next_hop = 1,
                                    .links = 1,
                                    .first = LinkCounts{.sent = 3, .sent_bytes = 300}});
  EXPECT_EQ(route_row(told.routes[0], "north", told, names).dump(),
            R"({"host":"north","base":"blocks","from":2,"from_name":"packer","to":1,"to_name":"gateway",)"
            R"("to_hosts":"5-9","next_hop":1,"links":1,"linked":true,"sent":3,"sent_bytes":300,"waiting":0,)"
            R"("congested":0,"received":0,"damaged":0,"expired":0})");
}

TEST(RowOfARoute, HasNoCountsOfALinkThatHasNotBeenMade) {
  const NodesTold told =
      routes_of({.from = 2, .to = 9, .hosts = {}, .next_hop = 9, .links = 1, .first = std::nullopt});
  const Row row = route_row(told.routes[0], "north", told, two_nodes());
  EXPECT_EQ(row["linked"], false);
  EXPECT_EQ(row["to_name"], "") << "no node of that address is known";
  EXPECT_TRUE(row["to_hosts"].is_null());
  for (const char* const count :
       {"sent", "sent_bytes", "waiting", "congested", "received", "damaged", "expired"}) {
    EXPECT_TRUE(row[count].is_null()) << count;
  }
}

}  // namespace
}  // namespace plchost
