#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <contract_bounds.hpp>
#include <control.h>

#include "api/dds/kept_record.hpp"
#include "api/dds/page_sample.hpp"
#include "shm/base/result.hpp"
#include "shm/block_driver/routes.hpp"

namespace plchost {

/// Which nodes, or the ways of which nodes, are asked for. An empty member asks for nothing.
struct NodeQuery {
  std::string base = {};    ///< empty: that of the host's configuration
  std::string node = {};    ///< this one alone, by name or address
  std::uint16_t after = 0;  ///< greater addresses only
};

/// The query as it travels. invalid_argument: a text that can be no name.
[[nodiscard]] Result<plc_ListPart> part_of(const NodeQuery& query);
/// And back. invalid_argument: a value that cannot be.
[[nodiscard]] Result<NodeQuery> node_query_of(const plc_ListPart& part);

/// A node as it is shown to clients.
struct ListedNode {
  NodeInfo info;
  std::string program;  ///< of its process; empty: it has ended
};

/// A part of what was asked for, by address.
struct NodeListing {
  std::string base;
  std::uint16_t host_number = 0;
  std::vector<ListedNode> nodes = {};
  std::vector<RouteInfo> routes = {};
  bool complete = true;
  std::uint16_t next_after = 0;  ///< not complete: the next part is what comes after this address
};

/// The bound of a page.
inline constexpr std::size_t kPageRoutes = dds::bounds::NodePage::routes;
static_assert(kPageRoutes >= kMaxRoutes);
static_assert(dds::bounds::NodePage::nodes >= kMaxNodes);

/// A listing as it travels.
class NodePageSample : public PageSample<plc_NodePage> {
 public:
  /// At most kMaxNodes and kPageRoutes.
  explicit NodePageSample(const NodeListing& listing);

 private:
  std::vector<plc_NodeRecord> nodes_;
  std::vector<std::vector<plc_HostRange>> hosts_;
  std::vector<plc_RouteRecord> routes_;
};

/// A page as a client keeps it.
struct NodesTold {
  NodesTold() = default;
  NodesTold(NodesTold&&) noexcept = default;
  NodesTold& operator=(NodesTold&&) noexcept = default;
  NodesTold(const NodesTold&) = delete;
  NodesTold& operator=(const NodesTold&) = delete;
  ~NodesTold() = default;

  std::string base;
  std::uint16_t host_number = 0;
  std::vector<dds::Kept<plc_NodeRecord>> nodes;
  std::vector<dds::Kept<plc_RouteRecord>> routes;
  bool complete = true;
  std::uint16_t next_after = 0;
  std::vector<std::vector<plc_HostRange>> hosts;  ///< of the nodes, which point to them
};
[[nodiscard]] NodesTold listing_of(const plc_NodePage& page);

}  // namespace plchost
