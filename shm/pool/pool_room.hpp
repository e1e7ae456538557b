#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>

#include <sys/types.h>

#include "shm/base/result.hpp"
#include "shm/pool/object_pool.hpp"

namespace plchost {

/// Bytes that shared memories may still take; the maximum: the host sets no limit. Set-up.
[[nodiscard]] std::uint64_t free_shared_memory() noexcept;

/// Whether the events and memories of an instance would find a place in its pool and in the host's shared
/// memory. It is asked before the process that has the instance's name ends and another one begins. Changes
/// nothing.
class PoolRoom {
 public:
  /// `process`: which one ends; 0: there is none. `free_bytes`: see free_shared_memory(). Error: the pool
  /// cannot be listed.
  [[nodiscard]] static Result<PoolRoom> of(const ObjectPool& pool, std::string_view instance, pid_t process,
                                           std::uint64_t free_bytes = free_shared_memory());

  /// The event of that name. full, wrong_type: as ObjectPool::create_event says it.
  [[nodiscard]] Result<void> take(std::string_view object);
  /// A memory of that name that the start makes, also in the place of an old one; one name, one memory. full:
  /// the pool has no place for it, or the host not so many bytes.
  [[nodiscard]] Result<void> take_memory(std::string_view object, std::uint64_t bytes);

 private:
  PoolRoom(const ObjectPool& pool, std::uint64_t free_bytes)
      : pool_(pool.name()), capacity_(pool.capacity()), free_bytes_(free_bytes) {}
  [[nodiscard]] Result<void> take_place(std::string_view kind, std::string_view object);

  std::string pool_;
  std::size_t capacity_ = 0;
  std::size_t free_ = 0;
  std::uint64_t free_bytes_ = 0;
  std::set<std::string, std::less<>> events_;  // that stay, and those that were taken
  std::set<std::string, std::less<>> others_;  // objects that stay and are no events
  std::set<std::string, std::less<>> made_;    // memories that were taken
};

}  // namespace plchost
