#pragma once

#include "shm/pool/pool_journal.hpp"
#include "shm/pool/pool_view.hpp"

namespace plchost {

/// The references of each process to the objects of the pool. All functions need the pool's mutex, and keep
/// to the segment whatever a stranger wrote into it: a list that is damaged is made anew.
class PoolReferences {
 public:
  PoolReferences(const PoolView& view, PoolJournal& journal) noexcept : view_(view), journal_(journal) {}

  /// Null: there are max_references already.
  [[nodiscard]] ReferenceEntry* add(ObjectEntry& object, ClientSlot& client, bool writable) noexcept;
  /// Null if its object is gone already.
  ObjectEntry* release(ReferenceEntry& reference) noexcept;
  /// The object that a used reference is on; null if it is another one now, or the place is free.
  [[nodiscard]] ObjectEntry* object_of(const ReferenceEntry& reference) const noexcept;
  /// Makes all lists anew; frees references on what is no object or of no client.
  void rebuild() noexcept;

 private:
  [[nodiscard]] ReferenceEntry* allocate() noexcept;
  void free(ReferenceEntry& reference) noexcept;
  void link(ReferenceEntry& reference, ObjectEntry& object, ClientSlot& client) noexcept;
  [[nodiscard]] bool unlink(ReferenceEntry& reference, Link& first, Link ReferenceEntry::* next,
                            Link ReferenceEntry::* previous) noexcept;

  void count_down(std::atomic<std::uint32_t>& count) noexcept;

  PoolView view_;
  PoolJournal& journal_;
};

}  // namespace plchost
