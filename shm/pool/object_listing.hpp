#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "shm/pool/object_info.hpp"
#include "shm/pool/pool_view.hpp"

namespace plchost {

class PoolSegment;

/// The processes that hold objects, at most kMostReferencesTold for each. They are collected from the table
/// of references part by part: the owner of the pool's mutex may let others have it in between. Set-up.
class ObjectHolders {
 public:
  /// By the key of the object.
  using Part = std::vector<std::pair<std::uint64_t, ReferenceInfo>>;
  /// Those in `count` places of references from `from` on.
  [[nodiscard]] static Part look_at(const PoolView& view, std::size_t from, std::size_t count);
  void add(Part part);
  /// Those of one object alone.
  [[nodiscard]] static ObjectHolders of(const PoolView& view, const ObjectEntry& object);
  [[nodiscard]] std::vector<ReferenceInfo> find(const PoolView& view, const ObjectEntry& object) const;

 private:
  /// An object that has the place of another one by now has another key.
  [[nodiscard]] static std::uint64_t key_of(const PoolView& view, const ObjectEntry& object) noexcept;
  std::unordered_map<std::uint64_t, std::vector<ReferenceInfo>> of_;
};

/// `across`: of a pool across containers. The numbers of its processes are not known yet: see start of
/// ReferenceInfo. With the pool's mutex held, or on what may change meanwhile: then the caller looks again.
[[nodiscard]] ObjectInfo describe_object(const PoolView& view, const ObjectEntry& entry,
                                         const ObjectHolders& holders, bool across);

/// Of a pool across containers: gives each holder the number that it has in the PID namespace of the caller.
/// Without the lock.
void number_as_seen(const PoolSegment& segment, std::span<ObjectInfo> objects);

}  // namespace plchost
