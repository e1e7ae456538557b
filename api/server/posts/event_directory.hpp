#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>

#include "shm/pool/object_pool.hpp"

namespace plchost {

/// From the name of an external event to its handle in the pool. Handles are kept, so that a post
/// needs neither the pool's index nor its lock. Used by one thread at a time.
class EventDirectory {
 public:
  explicit EventDirectory(const ObjectPool& pool) noexcept : pool_(&pool) {}

  /// not_found: the pool has no such event, or it is not registered; the text names it. Names must have been
  /// checked.
  [[nodiscard]] Result<PoolEvent> find(std::string_view instance, std::string_view event);
  /// The same, also of one that is not registered.
  [[nodiscard]] Result<PoolEvent> find_any(std::string_view instance, std::string_view event);

  /// How many handles are kept at most; then all are dropped and looked up anew.
  static constexpr std::size_t kMaxKept = 8192;

 private:
  struct TextHash {
    using is_transparent = void;
    std::size_t operator()(std::string_view text) const noexcept {
      return std::hash<std::string_view>{}(text);
    }
  };

  const ObjectPool* pool_;
  std::string name_;  // a buffer, so that looking up allocates nothing
  std::unordered_map<std::string, PoolEvent, TextHash, std::equal_to<>> kept_;
};

}  // namespace plchost
