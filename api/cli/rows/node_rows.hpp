#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "api/cli/rows/table.hpp"
#include "api/dds/node_page.hpp"

namespace plchost {

/// A node that sends blocks, or a way between two, for programs and for the table. The field names are a
/// promise.
[[nodiscard]] Row to_row(std::string_view host, const NodeListing& listing, const ListedNode& node);
/// `names`: of the nodes, for those that both ends are called by.
[[nodiscard]] Row to_row(std::string_view host, const NodeListing& listing, const RouteInfo& route,
                         const std::vector<ListedNode>& names);

[[nodiscard]] const std::vector<Column>& node_columns();
[[nodiscard]] const std::vector<Column>& route_columns();

}  // namespace plchost
