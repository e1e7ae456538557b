#pragma once

#include <string_view>
#include <vector>

#include "api/cli/rows/status_rows.hpp"
#include "api/dds/node_page.hpp"

namespace plchost {

/// The fields of the row of a node that sends blocks that its record has not: its host and what the page
/// tells.
[[nodiscard]] dds::Computed<plc_NodeRecord, Row> computed_of(const plc_NodeRecord& node,
                                                             std::string_view host, const NodesTold& page);
/// The same of a way between two. `names`: of the nodes, for those that both ends are called by.
[[nodiscard]] dds::Computed<plc_RouteRecord, Row> computed_of(const plc_RouteRecord& route,
                                                              std::string_view host, const NodesTold& page,
                                                              const NodesTold& names);

/// A way between two nodes. The counts of its first link are null as long as that has not been made.
[[nodiscard]] Row route_row(const plc_RouteRecord& route, std::string_view host, const NodesTold& page,
                            const NodesTold& names);

}  // namespace plchost
