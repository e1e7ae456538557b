#pragma once

#include <string>
#include <utility>

#include "api/dds/node_page.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Lists the nodes of a pool that send blocks to each other, and the ways between them, for clients. Control
/// loop only.
class NodeLister {
 public:
  /// `base`: of queries that name none.
  NodeLister(std::string pool, std::string base) : pool_(std::move(pool)), base_(std::move(base)) {}

  /// Complete: there are at most kMaxNodes. not_found: no node is called so; lists those that there are.
  /// corrupt: there is something else in the place of the directory.
  [[nodiscard]] Result<NodeListing> nodes(const NodeQuery& query) const;
  /// The ways of at least one node more; the page ends at kPageRoutes, and when the clock passes `until`.
  /// Errors as nodes().
  [[nodiscard]] Result<NodeListing> routes(const NodeQuery& query, TimePoint until) const;
  [[nodiscard]] Result<NodeListing> routes(const NodeQuery& query) const {
    return routes(query, MonotonicClock::now() + kPageTime);
  }

  static constexpr Duration kPageTime = std::chrono::milliseconds(5);

 private:
  std::string pool_;
  std::string base_;
};

}  // namespace plchost
