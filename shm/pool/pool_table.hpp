#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "shm/pool/object_type.hpp"
#include "shm/pool/pool_view.hpp"

namespace plchost {

/// The objects of a pool by name. All functions but peek() need the pool's mutex. Whatever a stranger wrote
/// into the segment, each of them ends, after at most one look at every entry, and touches nothing outside of
/// the segment.
class PoolTable {
 public:
  explicit PoolTable(const PoolView& view) noexcept : view_(view) {}

  /// Null if there is none; makes the index anew if it is damaged.
  [[nodiscard]] ObjectEntry* find(std::string_view name) noexcept;
  /// The same, only looking; null, too, if the index is damaged.
  [[nodiscard]] ObjectEntry* peek(std::string_view name) const noexcept;
  /// `name` is not in the table. The entry has no references and is there for others, and after the end of
  /// this process, only when it is published. Null if the table is full and nothing can be reclaimed.
  [[nodiscard]] ObjectEntry* insert(std::string_view name, ObjectType type) noexcept;
  static void publish(ObjectEntry& entry) noexcept;
  /// Frees it; handles on it are invalid from here on.
  void erase(ObjectEntry& entry) noexcept;
  /// Makes the index and the free list anew from the entries, and frees those that are not valid.
  void rebuild() noexcept;

  [[nodiscard]] static bool is_valid(const ObjectEntry& entry) noexcept;
  /// Nobody needs it: neither kept nor referenced, and an event neither registered nor bound.
  [[nodiscard]] static bool is_idle(const ObjectEntry& entry) noexcept;

 private:
  [[nodiscard]] Link& bucket_of(std::string_view name) const noexcept;
  /// The link that leads to the entry, or the last one (that holds 0) of the chain. Null: the chain is
  /// damaged.
  [[nodiscard]] Link* walk(std::string_view name) const noexcept;
  [[nodiscard]] ObjectEntry* allocate() noexcept;
  [[nodiscard]] bool free_places_are_sane() const noexcept;
  [[nodiscard]] ObjectEntry* reclaim() noexcept;
  /// Takes it out of its chain. False: it was not in it.
  bool unlink(ObjectEntry& entry) noexcept;

  PoolView view_;
};

}  // namespace plchost
