#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "shm/pool/object_pool.hpp"
#include "shm/pool/pool_layout.hpp"

namespace plchost {

/// The objects of a pool by name. All functions need the pool's mutex. Whatever a stranger wrote into the
/// segment, each of them ends, after at most one look at every entry, and touches nothing outside of the
/// segment.
class PoolTable {
 public:
  /// `memory` holds at least pool_size(max_objects) bytes.
  PoolTable(std::span<std::byte> memory, std::uint32_t max_objects) noexcept;

  [[nodiscard]] PoolHeader& header() const noexcept { return *header_; }

  /// Null if there is none.
  [[nodiscard]] ObjectEntry* find(std::string_view name) noexcept;
  /// `name` is not in the table. Null if it is full and nothing can be reclaimed.
  [[nodiscard]] ObjectEntry* insert(std::string_view name, ObjectType type) noexcept;
  /// Makes the index and the free list anew from the entries, and frees those that are not valid.
  void rebuild() noexcept;
  /// All entries that were ever used.
  [[nodiscard]] std::span<ObjectEntry> entries() const noexcept;
  [[nodiscard]] static bool is_valid(const ObjectEntry& entry) noexcept;

 private:
  using Link = std::atomic<std::uint32_t>;

  [[nodiscard]] Link& bucket_of(std::string_view name) const noexcept;
  /// The link that leads to the entry, or the last one (that holds 0) of the chain. Null: the chain is
  /// damaged.
  [[nodiscard]] Link* walk(std::string_view name) const noexcept;
  [[nodiscard]] ObjectEntry* entry_at(std::uint32_t link) const noexcept;
  [[nodiscard]] std::uint32_t link_of(const ObjectEntry& entry) const noexcept;
  [[nodiscard]] ObjectEntry* allocate() noexcept;
  [[nodiscard]] bool free_places_are_sane() const noexcept;
  [[nodiscard]] ObjectEntry* reclaim() noexcept;
  /// Frees it. False if it was not in its chain.
  bool unlink(ObjectEntry& entry) noexcept;

  PoolHeader* header_;
  std::span<Link> buckets_;
  std::span<ObjectEntry> entries_;
};

/// Whether an object may have this name: 1 to kMaxObjectName printable ASCII characters.
[[nodiscard]] bool is_object_name(std::string_view name) noexcept;

}  // namespace plchost
