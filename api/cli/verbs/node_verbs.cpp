#include "api/cli/verbs/node_verbs.hpp"

#include <memory>

#include <fmt/format.h>

#include "api/cli/rows/node_rows.hpp"
#include "api/dds/page_sample.hpp"

namespace plchost {

namespace {

// All pages of one host. The timeout is that of one page.
Result<std::vector<NodesTold>> route_pages(CliSession& session, const std::string& host, NodeQuery query) {
  std::vector<NodesTold> pages;
  for (bool goes_on = true; goes_on;) {
    PLCHOST_TRY_ASSIGN(auto page, session.client().value()->list_routes(host, query, session.deadline()));
    PLCHOST_TRY_ASSIGN(goes_on, next_page(host, page, query));
    pages.push_back(std::move(page));
  }
  return pages;
}

int list_nodes(CliSession& session, const std::string& base) {
  const auto hosts = session.shown_hosts();
  if (!hosts) return CliSession::fail(hosts.error());
  std::vector<Row> rows;
  for (const HostView& host : *hosts) {
    const auto listing = session.client().value()->list_nodes(host.name, {.base = base}, session.deadline());
    if (!listing) return CliSession::fail(listing.error());
    for (const plc_NodeRecord& node : listing->nodes) {
      rows.push_back(to_row(node, std::string_view(host.name), *listing));
    }
  }
  return session.show(rows, columns_of<plc_NodeRecord>());
}

int show_routes(CliSession& session, const std::string& node, const std::string& base) {
  // Of one node: of the host that is meant; without: of all hosts that are shown.
  std::vector<std::string> hosts;
  if (node.empty()) {
    const auto shown = session.shown_hosts();
    if (!shown) return CliSession::fail(shown.error());
    for (const HostView& host : *shown) hosts.push_back(host.name);
  } else {
    auto host = session.target_host();
    if (!host) return CliSession::fail(host.error());
    hosts.push_back(*std::move(host));
  }
  std::vector<Row> rows;
  for (const std::string& host : hosts) {
    const auto pages = route_pages(session, host, {.base = base, .node = node});
    if (!pages) return CliSession::fail(pages.error());
    const auto names = session.client().value()->list_nodes(host, {.base = base}, session.deadline());
    if (!names) return CliSession::fail(names.error());
    for (const NodesTold& page : *pages) {
      for (const plc_RouteRecord& route : page.routes) rows.push_back(route_row(route, host, page, *names));
    }
  }
  return session.show(rows, columns_of<plc_RouteRecord>());
}

constexpr const char* kBaseText = "nodes of this base name (default: [blocks] base of the host)";

}  // namespace

void add_list_nodes(const Command& verb, CliSession& session) {
  const auto base = std::make_shared<std::string>();
  verb.noun("nodes", "The nodes that send each other blocks, and their counts",
            [&session, base] { return list_nodes(session, *base); })
      .optional("--base", *base, kBaseText);
}

void add_show_routes(const Command& verb, CliSession& session) {
  const auto node = std::make_shared<std::string>();
  const auto base = std::make_shared<std::string>();
  verb.noun("routes",
            "How blocks go from each node to all others: the next node, the links that it takes, and the "
            "counts of the first of them",
            [&session, node, base] { return show_routes(session, *node, *base); })
      .optional("NODE", *node, "only from this one, by name or address")
      .optional("--base", *base, kBaseText);
}

}  // namespace plchost
