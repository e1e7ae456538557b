#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "api/dds/object_page.hpp"
#include "api/dds/object_query.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/pool/object_pool.hpp"

namespace plchost {

/// Lists the objects of a pool for clients, page by page. A look at a large pool takes time: its result is
/// used for some time. So less than a fifth of the time goes into looks, however many clients ask. Control
/// loop only.
class ObjectLister {
 public:
  explicit ObjectLister(const ObjectPool& pool) noexcept : pool_(&pool) {}

  /// A page of what the query asks for; always one object, or one look, further. It ends at kPageObjects and
  /// kPageReferences, and when the clock passes `until`. not_found: no object of the query's name; one that
  /// is nearly called so is named.
  [[nodiscard]] Result<ObjectListing> page(const ObjectQuery& query, TimePoint until);
  [[nodiscard]] Result<ObjectListing> page(const ObjectQuery& query) {
    return page(query, MonotonicClock::now() + kPageTime);
  }

  /// Gives the memory back that nobody asked for lately. To be called every 10 ms.
  void forget_old(TimePoint now);

  static constexpr Duration kPageTime = std::chrono::milliseconds(5);

 private:
  [[nodiscard]] Result<ObjectListing> one(const std::string& name);
  [[nodiscard]] std::string like(std::string_view name);
  [[nodiscard]] Result<void> look();

  const ObjectPool* pool_;
  std::vector<ObjectInfo> seen_;  // by name
  TimePoint seen_until_;          // and to be looked at anew from then on
  TimePoint wanted_;              // the last time that somebody did
};

}  // namespace plchost
