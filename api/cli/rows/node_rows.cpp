#include "api/cli/rows/node_rows.hpp"

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>

#include <fmt/format.h>

#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"

namespace plchost {

namespace {

// "2, 5-9"; empty: none.
std::string hosts_text(std::span<const plc_HostRange> ranges) {
  std::string text;
  for (const plc_HostRange& hosts : ranges) {
    if (hosts.first == 0) continue;
    text += fmt::format("{}{}", text.empty() ? "" : ", ", hosts.first);
    if (hosts.last != hosts.first) text += fmt::format("-{}", hosts.last);
  }
  return text;
}

std::string name_of(std::uint16_t node, const NodesTold& names) {
  const auto found = std::ranges::find(names.nodes, node, &plc_NodeRecord::node);
  return found == names.nodes.end() ? std::string() : std::string(dds::text_of(found->name));
}

}  // namespace

dds::Computed<plc_NodeRecord, Row> computed_of(const plc_NodeRecord& node, std::string_view host,
                                               const NodesTold& page) {
  return {.host = host,
          .base = page.base,
          .host_number = page.host_number,
          .hosts = hosts_text(dds::parts_of(node.hosts))};
}

dds::Computed<plc_RouteRecord, Row> computed_of(const plc_RouteRecord& route, std::string_view host,
                                                const NodesTold& page, const NodesTold& names) {
  const bool to_hosts = route.hosts.first != 0;
  return {.host = host,
          .base = page.base,
          .from_name = name_of(route.from_node, names),
          .to_name = name_of(route.to_node, names),
          .to_hosts = to_hosts ? Row(hosts_text(std::span(&route.hosts, 1))) : Row()};
}

// Without a link there is nothing to count. The counts are the 64-bit members of the record.
Row route_row(const plc_RouteRecord& route, std::string_view host, const NodesTold& page,
              const NodesTold& names) {
  Row row = to_row(route, host, page, names);
  if (route.linked) return row;
  dds::visit_row(route, dds::Computed<plc_RouteRecord, Row>{},
                 [&row](const dds::FieldInfo& field, const auto& value) {
                   using Value = std::remove_cvref_t<decltype(value)>;
                   if constexpr (std::same_as<Value, std::uint64_t>) row[std::string(field.row)] = nullptr;
                 });
  return row;
}

}  // namespace plchost
