#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <pthread.h>

#include "shm/base/counted_event.hpp"
#include "shm/base/names.hpp"

// The pool as it lies in shared memory. Anyone with the right to map it may have scribbled in it, so whatever
// is read here is checked before it is used, and sizes are read once, at attach.
//
//   [ PoolHeader ][ std::atomic<u32> buckets[bucket_count] ][ ObjectEntry entries[max_objects] ]
//
// Objects hang in chains by the hash of their name: bucket -> entry.next -> ... A link is the index of an
// entry plus one, so that zero-filled memory is a valid empty table.

namespace plchost {

inline constexpr std::uint64_t kPoolMagic = 0x6c6f6f70'74736f68;  // "hostpool"
/// 1: first.
inline constexpr std::uint32_t kPoolVersion = 1;

enum class EntryState : std::uint32_t { free = 0, used = 1 };

struct alignas(64) ObjectEntry {
  // One cache line of its own: all that a post touches.
  CountedEvent event;
  /// Who may post and wait, in one word, so that taking an entry away and binding it cannot both succeed:
  /// [ generation : 32 ][ registered : 1 ][ bound tasks : 31 ]
  std::atomic<std::uint64_t> binding;
  /// The event's count when it was made; an event that takes over an entry goes on counting from there.
  std::atomic<std::uint64_t> first_count;
  std::atomic<std::uint32_t> state;  ///< an EntryState; written last when the object is made
  std::atomic<std::uint32_t> type;   ///< an ObjectType
  std::atomic<std::uint32_t> next;   ///< link in the chain of the bucket, or of the free list
  std::array<std::uint32_t, 7> reserved0;
  // Written with the mutex held, before the state.
  FixedText<kMaxObjectName> name;
  std::array<std::uint32_t, 8> reserved1;
};
static_assert(sizeof(ObjectEntry) == 192 && offsetof(ObjectEntry, binding) == 8);
static_assert(offsetof(ObjectEntry, state) == 24 && offsetof(ObjectEntry, next) == 32);
static_assert(offsetof(ObjectEntry, name) == 64 && sizeof(FixedText<kMaxObjectName>) == 96);

struct alignas(64) PoolHeader {
  std::atomic<std::uint64_t> magic;  ///< written last, with release
  std::uint32_t version;
  std::uint32_t entry_size;
  std::uint64_t size;  ///< of the whole segment, bytes
  std::uint32_t max_objects;
  std::uint32_t bucket_count;
  std::array<std::uint32_t, 8> reserved0;

  alignas(64) pthread_mutex_t mutex;  ///< robust, inherits priority; guards set-up only
  std::array<std::byte, 64 - sizeof(pthread_mutex_t)> reserved1;

  // Guarded by the mutex.
  std::atomic<std::uint32_t> high_water;    ///< entries from here on were never used
  std::atomic<std::uint32_t> first_free;    ///< link
  std::atomic<std::uint32_t> reclaim_hand;  ///< where the search for one to reclaim goes on
  std::atomic<std::uint32_t> repairs;       ///< how often the index was rebuilt
  std::array<std::uint32_t, 12> reserved2;
};
static_assert(sizeof(PoolHeader) == 192 && offsetof(PoolHeader, version) == 8);
static_assert(offsetof(PoolHeader, mutex) == 64 && offsetof(PoolHeader, high_water) == 128);
static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

/// At most one object for each bucket, on average.
[[nodiscard]] constexpr std::uint32_t bucket_count_for(std::uint32_t max_objects) noexcept {
  return std::bit_ceil(max_objects);
}
[[nodiscard]] constexpr std::size_t entries_offset(std::uint32_t max_objects) noexcept {
  const std::size_t end =
      sizeof(PoolHeader) + std::size_t{bucket_count_for(max_objects)} * sizeof(std::uint32_t);
  return (end + alignof(ObjectEntry) - 1) / alignof(ObjectEntry) * alignof(ObjectEntry);
}
[[nodiscard]] constexpr std::size_t pool_size(std::uint32_t max_objects) noexcept {
  return entries_offset(max_objects) + std::size_t{max_objects} * sizeof(ObjectEntry);
}

/// The parts of ObjectEntry::binding.
struct Binding {
  static constexpr std::uint64_t kRegistered = std::uint64_t{1} << 31;
  static constexpr std::uint64_t kBoundMask = kRegistered - 1;

  [[nodiscard]] static constexpr std::uint32_t generation(std::uint64_t word) noexcept {
    return static_cast<std::uint32_t>(word >> 32);
  }
  [[nodiscard]] static constexpr bool registered(std::uint64_t word) noexcept {
    return (word & kRegistered) != 0;
  }
  [[nodiscard]] static constexpr std::uint32_t bound(std::uint64_t word) noexcept {
    return static_cast<std::uint32_t>(word & kBoundMask);
  }
  [[nodiscard]] static constexpr bool in_use(std::uint64_t word) noexcept {
    return (word & (kRegistered | kBoundMask)) != 0;
  }
  [[nodiscard]] static constexpr std::uint64_t next_generation(std::uint64_t word) noexcept {
    return (std::uint64_t{generation(word)} + 1) << 32;
  }
};

}  // namespace plchost
