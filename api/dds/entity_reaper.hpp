#pragma once

#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "api/dds/entity.hpp"
#include "shm/base/result.hpp"
#include "shm/threads/thread.hpp"

namespace plchost::dds {

/// Deletes DDS entities on a soft thread of its own. Cyclone waits in dds_delete() for threads of its own,
/// which may get no core for a while, and for readers that do not acknowledge.
class EntityReaper {
 public:
  [[nodiscard]] static Result<std::unique_ptr<EntityReaper>> create();
  EntityReaper(const EntityReaper&) = delete;
  EntityReaper& operator=(const EntityReaper&) = delete;
  /// Returns when all are deleted.
  ~EntityReaper();

  /// Any thread. In the order given. Of more than kMost that wait, the caller deletes its own.
  static constexpr std::size_t kMost = 4096;
  void take(std::vector<Entity> entities);

 private:
  EntityReaper() = default;
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Entity> waiting_;
  bool stopping_ = false;
  Thread thread_;
};

}  // namespace plchost::dds
