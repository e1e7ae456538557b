#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "shm/pool/pool_journal.hpp"
#include "shm/pool/pool_layout.hpp"
#include "shm/pool/pool_view.hpp"

namespace plchost {

/// The objects of a pool by name. All functions but peek() need the pool's mutex. Each of them ends after at
/// most one look at every entry, and touches nothing outside of the segment, also if a stranger wrote into
/// it.
class PoolTable {
 public:
  PoolTable(const PoolView& view, PoolJournal& journal) noexcept : view_(view), journal_(journal) {}

  /// Null if there is none; makes the index anew if it is damaged.
  [[nodiscard]] ObjectEntry* find(std::string_view name) noexcept;
  /// The same, only looking; null, too, if the index is damaged.
  [[nodiscard]] static ObjectEntry* peek(const PoolView& view, std::string_view name) noexcept;
  /// `name` is not in the table. The entry is unsettled, has no references and is there for others only when
  /// it is published. Null if the table is full and nothing can be reclaimed.
  [[nodiscard]] ObjectEntry* insert(std::string_view name, ObjectType type) noexcept;
  void publish(ObjectEntry& entry) noexcept;
  /// From here on no process finds it, and the next process erases it if this one ends.
  void withdraw(ObjectEntry& entry) noexcept;
  /// Frees it; handles on it are invalid from here on.
  void erase(ObjectEntry& entry) noexcept;
  /// Makes the index and the free list anew from the entries, and frees those that are not valid. A process
  /// that ends in here leaves `rebuilding` behind.
  void rebuild() noexcept;

  [[nodiscard]] static bool is_valid(const ObjectEntry& entry) noexcept;
  /// Nobody needs it: neither kept nor referenced, and an event neither registered nor bound.
  [[nodiscard]] static bool is_idle(const ObjectEntry& entry) noexcept;

 private:
  [[nodiscard]] ObjectEntry* allocate() noexcept;
  [[nodiscard]] bool free_places_are_sane() const noexcept;
  /// Makes a free place of one that is not needed. False: there is none.
  bool reclaim() noexcept;
  void set_state(ObjectEntry& entry, EntryState state) noexcept;
  void put(ObjectEntry& entry, Link& first) noexcept;

  PoolView view_;
  PoolJournal& journal_;
};

}  // namespace plchost
