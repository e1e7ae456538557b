#pragma once

#include "shm/pool/pool_journal.hpp"
#include "shm/pool/pool_view.hpp"

namespace plchost {

/// The references of each process to the objects of the pool. All functions need the pool's mutex, and keep
/// to the segment whatever a stranger wrote into it: counts and the free list are made anew if they are
/// damaged.
class PoolReferences {
 public:
  PoolReferences(const PoolView& view, PoolJournal& journal) noexcept : view_(view), journal_(journal) {}

  /// Null: there are max_references already.
  [[nodiscard]] ReferenceEntry* add(ObjectEntry& object, ClientSlot& client, bool writable) noexcept;
  /// Null if its object is gone already.
  ObjectEntry* release(ReferenceEntry& reference) noexcept;
  /// Makes all counts and the free list anew; frees references on what is no object or of no client.
  void rebuild() noexcept;

 private:
  [[nodiscard]] ReferenceEntry* allocate() noexcept;
  [[nodiscard]] bool is_full() const noexcept;
  void free(ReferenceEntry& reference) noexcept;
  void count_up(std::atomic<std::uint32_t>& count) noexcept;
  void count_down(std::atomic<std::uint32_t>& count) noexcept;

  PoolView view_;
  PoolJournal& journal_;
};

}  // namespace plchost
