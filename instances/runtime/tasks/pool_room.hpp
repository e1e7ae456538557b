#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <string_view>

#include <sys/types.h>

#include "shm/base/result.hpp"
#include "shm/pool/object_pool.hpp"

namespace plchost {

/// Whether the events of an instance would find a place in its pool, if the process that has the instance's
/// name now ended and another one began. Changes nothing.
class PoolRoom {
 public:
  /// `process`: which one ends; 0: there is none. Error: the pool cannot be listed.
  [[nodiscard]] static Result<PoolRoom> of(const ObjectPool& pool, std::string_view instance, pid_t process);

  /// The event of that name. full, wrong_type: as ObjectPool::create_event says it.
  [[nodiscard]] Result<void> take(std::string_view object);

 private:
  explicit PoolRoom(const ObjectPool& pool) : pool_(pool.name()), capacity_(pool.capacity()) {}

  std::string pool_;
  std::size_t capacity_ = 0;
  std::size_t free_ = 0;
  std::set<std::string, std::less<>> events_;  // that stay, and those that were taken
  std::set<std::string, std::less<>> others_;  // objects that stay and are no events
};

}  // namespace plchost
