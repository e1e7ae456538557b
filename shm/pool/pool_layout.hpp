#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <string_view>

#include <sys/types.h>

#include "shm/base/counted_event.hpp"
#include "shm/base/counting_semaphore.hpp"
#include "shm/base/names.hpp"
#include "shm/threads/robust_mutex.hpp"

// The pool as it lies in shared memory. Anyone with the right to map it may have scribbled in it, so whatever
// is read here is checked before it is used, and sizes are read once, at attach. There are no pointers in it.
//
//   [ PoolHeader ][ ClientSlot clients[kMaxClients] ][ ReferenceEntry references[max_references] ]
//   [ ObjectEntry entries[max_objects] ][ std::atomic<u32> buckets[bucket_count] ]
//
// Objects hang in chains by the hash of their name: bucket -> entry.next -> ... References are a flat table:
// each names its object and its client, and both count theirs. A search goes through the whole table: for
// the references of a client that has ended, and for lists. A link is the index of an entry plus one, so
// that zero-filled memory is a valid empty table. The next process undoes the unfinished step of a killed one
// (see PoolJournal). All lists can be made anew from the entries themselves: that is for what strangers do to
// them.

namespace plchost {

inline constexpr std::uint64_t kPoolMagic = 0x6c6f6f70'74736f68;  // "hostpool"
/// 1: first. 2: semaphores, mutexes, memories, clients and their references. 3: notes of what is changed. 4:
/// the PID namespace. 5: events say whether posts are taken, and are marked. 6: references are a flat table.
inline constexpr std::uint32_t kPoolVersion = 6;
/// The same layout, of a pool whose users may be in several PID namespaces: a version of its own with each
/// kPoolVersion. The mutexes are ClientMutexes, and whether a client runs is told by ClientLocks. Programs
/// that do not know it refuse it.
inline constexpr std::uint32_t kPoolVersionAcross = kPoolVersion + 1000;

/// Of what the pool's mutex orders, or what is checked after it was read without it.
inline constexpr auto kRelaxed = std::memory_order_relaxed;

using Link = std::atomic<std::uint32_t>;

/// The seed's objTabType_t, with the same numbers, and a type that it does not have.
enum class ObjectType : std::uint32_t { memory = 0, semaphore = 1, event = 2, mutex = 3 };
inline constexpr std::uint32_t kObjectTypes = 4;

/// Free memory is all zero, so that 0 is free.
enum class EntryState : std::uint32_t {
  free = 0,
  used = 1,
  changing = 2,  ///< half-made, or half-gone
};

struct alignas(64) ObjectEntry {
  // One cache line of its own: all that a post, wait, lock or unlock touches.
  CountedEvent event;
  /// The registration and the bound tasks in one word, so that taking an entry away and binding it cannot
  /// both succeed: [ generation : 32 ][ registered : 1 ][ bound tasks : 31 ]. Objects of all types have their
  /// generation here.
  std::atomic<std::uint64_t> binding;
  CountingSemaphore semaphore;
  std::atomic<std::uint32_t> state;  ///< an EntryState; written last when the object is made
  RobustMutex mutex;                 ///< see PoolMutex
  std::atomic<std::uint64_t> size;   ///< memory: bytes
  std::atomic<std::uint32_t> type;   ///< an ObjectType
  Link next;                         ///< in the chain of the bucket, or of the free list
  std::atomic<std::uint32_t> reserved;
  std::atomic<std::uint32_t> reference_count;

  // Written with the mutex held, before the state.
  FixedText<kMaxObjectName> name;
  /// The event's count when it was made; an event that takes over an entry goes on counting from there.
  std::atomic<std::uint64_t> first_count;
  std::atomic<std::uint32_t> attributes;
  std::atomic<std::uint32_t> mode;  ///< permission bits, as those of a file
  std::atomic<std::uint32_t> owner;
  std::atomic<std::uint32_t> group;
  std::atomic<std::int64_t> made_unix_ns;
};
static_assert(sizeof(ObjectEntry) == 192 && offsetof(ObjectEntry, binding) == 8);
static_assert(offsetof(ObjectEntry, semaphore) == 16 && offsetof(ObjectEntry, mutex) == 24);
static_assert(offsetof(ObjectEntry, size) == 40 && offsetof(ObjectEntry, name) == 64);
static_assert(offsetof(ObjectEntry, first_count) == 160 && offsetof(ObjectEntry, made_unix_ns) == 184);

/// ObjectEntry::attributes.
inline constexpr std::uint32_t kKept = 1;     ///< stays without references, until it is removed
inline constexpr std::uint32_t kDirect = 2;   ///< event: stays by its references, not by registration
inline constexpr std::uint32_t kAdopted = 4;  ///< memory: its file was there first, and outlives a repair

/// One user of the pool: an ObjectPool in a process.
struct alignas(64) ClientSlot {
  std::atomic<std::uint32_t> pid;         ///< as the process itself sees it; 0: free; written last
  std::atomic<std::uint32_t> generation;  ///< grows with each client of the slot
  std::atomic<std::uint64_t> start;     ///< of the process, see start_of(); across: its ClientLocks::number()
  std::atomic<std::int64_t> looked_ns;  ///< CLOCK_MONOTONIC when it was last seen alive
  std::atomic<std::uint32_t> released;  ///< so many places of references were searched for those it had
  std::atomic<std::uint32_t> reference_count;
  std::atomic<std::uint32_t> ended;  ///< 1: its references are being released
  std::atomic<std::uint32_t> image;  ///< of the process, see image_of()
  FixedText<23> name;                ///< of the program
};
static_assert(sizeof(ClientSlot) == 64 && offsetof(ClientSlot, name) == 40);

/// One client's hold on one object.
struct alignas(32) ReferenceEntry {
  Link object;  ///< 0: free; written last
  std::atomic<std::uint32_t> object_generation;
  Link client;
  std::atomic<std::uint32_t> generation;  ///< grows with each reference that has this place
  std::atomic<std::uint32_t> writable;    ///< 1: may change the object; 0: only reads
  std::atomic<std::uint32_t> waiting;     ///< so many threads of the client wait for it
  std::atomic<std::uint32_t> client_generation;
  Link next_free;  ///< in the list of free places
};
static_assert(sizeof(ReferenceEntry) == 32 && offsetof(ReferenceEntry, waiting) == 20);

struct alignas(64) PoolHeader {
  std::atomic<std::uint64_t> magic;  ///< written last, with release
  std::uint32_t version;
  std::uint32_t entry_size;
  std::uint64_t size;  ///< of the whole segment, bytes
  std::uint32_t max_objects;
  std::uint32_t bucket_count;
  std::uint32_t max_clients;
  std::uint32_t max_references;
  /// Of all clients, see plchost::pid_namespace(). All numbers of processes here are of that namespace.
  /// Across: the number of the file of the locks of all clients, see ClientLocks::make().
  std::uint64_t pid_namespace;
  std::array<std::uint32_t, 4> reserved0;

  alignas(64) RobustMutex mutex;  ///< guards set-up only; see PoolMutex
  /// Odd while a process changes the data that the mutex guards: for readers without the right to write.
  std::atomic<std::uint64_t> changes;
  std::array<std::uint32_t, 2> reserved1;
  /// For a process that attaches when a stranger has written over the first line.
  std::atomic<std::uint64_t> magic_again;
  std::uint32_t version_again;
  std::uint32_t max_objects_again;
  std::uint64_t pid_namespace_again;
  std::array<std::uint32_t, 2> reserved2;

  // Guarded by the mutex. Those that count only grow.
  std::atomic<std::uint32_t> high_water;    ///< entries from here on were never used
  Link first_free;                          ///< of the entries
  std::atomic<std::uint32_t> reclaim_hand;  ///< where the search for one to reclaim goes on
  std::atomic<std::uint32_t> repairs;       ///< how often an owner of the mutex had ended
  std::atomic<std::uint32_t> reference_high_water;
  Link first_free_reference;
  std::atomic<std::uint32_t> client_high_water;
  std::atomic<std::uint32_t> departed;  ///< clients that ended without releasing what they held
  Link unsettled;  ///< the object that is being made or taken away, with its file if it is a memory
  std::atomic<std::uint32_t> rebuilding;    ///< 1: the lists are being made anew
  std::atomic<std::uint32_t> rebuilds;      ///< how often they were, because a stranger had damaged them
  std::atomic<std::uint32_t> lost_objects;  ///< objects that were not valid then
  std::atomic<std::uint32_t>
      header_mended;  ///< how often what write_pool_constants() writes was written anew
  std::atomic<std::uint32_t> client_numbers;  ///< across: the next one; see ClientLocks. Not guarded
  std::array<std::uint32_t, 2> reserved3;

  alignas(64) std::atomic<std::uint32_t> noted;  ///< of the notes, those that count
  std::uint32_t reserved4;
  /// Of words that were changed since `noted` was 0: [ place, in words from the header's begin ][ value ].
  std::array<std::atomic<std::uint64_t>, 63> notes;
};
static_assert(sizeof(PoolHeader) == 704 && offsetof(PoolHeader, version) == 8);
static_assert(offsetof(PoolHeader, pid_namespace) == 40 && offsetof(PoolHeader, pid_namespace_again) == 112);
static_assert(offsetof(PoolHeader, mutex) == 64 && offsetof(PoolHeader, high_water) == 128);
static_assert(offsetof(PoolHeader, noted) == 192 && offsetof(PoolHeader, notes) == 200);
static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

inline constexpr std::uint32_t kMaxClients = 512;

/// At most one object for each bucket, on average.
[[nodiscard]] constexpr std::uint32_t bucket_count_for(std::uint32_t max_objects) noexcept {
  return std::bit_ceil(max_objects);
}
[[nodiscard]] constexpr std::uint32_t max_references_for(std::uint32_t max_objects) noexcept {
  return 2 * max_objects + 1024;
}
inline constexpr std::size_t kClientsOffset = sizeof(PoolHeader);
inline constexpr std::size_t kReferencesOffset = kClientsOffset + kMaxClients * sizeof(ClientSlot);
[[nodiscard]] constexpr std::size_t entries_offset(std::uint32_t max_objects) noexcept {
  return kReferencesOffset + std::size_t{max_references_for(max_objects)} * sizeof(ReferenceEntry);
}
[[nodiscard]] constexpr std::size_t buckets_offset(std::uint32_t max_objects) noexcept {
  return entries_offset(max_objects) + std::size_t{max_objects} * sizeof(ObjectEntry);
}
[[nodiscard]] constexpr std::size_t pool_size(std::uint32_t max_objects) noexcept {
  return buckets_offset(max_objects) + std::size_t{bucket_count_for(max_objects)} * sizeof(Link);
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

/// The traits of one type of objects: a row of kObjectTraits. The default of each trait is that of a type
/// which is not known, as a newer host may have it.
struct ObjectTraits {
  ObjectType type{};
  std::string_view name = "unknown";         ///< for people and in queries: "semaphore"
  std::string_view value_form = "value {}";  ///< how a value is told; {}: the number
  bool has_size = false;                     ///< and no value: lists show the size
  bool has_holder = false;                   ///< the value is the thread that holds it; 0: none
  bool has_tasks = false;                    ///< it can be registered, and tasks are bound to it
  /// Bounds of the initial value. Of a memory it is the size in bytes.
  std::uint64_t least_initial = 0;
  std::uint64_t most_initial = 0;
  /// Gives a new entry its initial value. Set-up, with the mutex held, before others find the entry.
  void (*begin)(ObjectEntry& entry, std::uint64_t initial) noexcept = nullptr;
  /// The value that lists show; 0 of a memory, whose size they show. Any context.
  std::uint64_t (*value)(const ObjectEntry& entry) noexcept = nullptr;
};

/// By the numbers of the types.
inline constexpr std::array<ObjectTraits, kObjectTypes> kObjectTraits{
    {{.type = ObjectType::memory,
      .name = "memory",
      .value_form = "{} bytes",
      .has_size = true,
      .least_initial = 1,
      .most_initial = static_cast<std::uint64_t>(std::numeric_limits<off_t>::max()),
      .begin = [](ObjectEntry& entry, std::uint64_t bytes) noexcept { entry.size.store(bytes, kRelaxed); },
      .value = [](const ObjectEntry& /*entry*/) noexcept { return std::uint64_t{0}; }},
     {.type = ObjectType::semaphore,
      .name = "semaphore",
      .value_form = "value {}",
      .least_initial = 0,
      .most_initial = CountingSemaphore::kMaxValue,
      .begin =
          [](ObjectEntry& entry, std::uint64_t units) noexcept {
            new (&entry.semaphore) CountingSemaphore(static_cast<std::uint32_t>(units));
          },
      .value = [](const ObjectEntry& entry) noexcept { return std::uint64_t{entry.semaphore.value()}; }},
     {.type = ObjectType::event,
      .name = "event",
      .value_form = "posts {}",
      .has_tasks = true,
      .least_initial = 0,
      .most_initial = 0,
      .begin = [](ObjectEntry& entry,
                  std::uint64_t /*none*/) noexcept { entry.binding.fetch_or(Binding::kRegistered); },
      .value =
          [](const ObjectEntry& entry) noexcept {
            return (entry.event.count() - entry.first_count.load(kRelaxed)) & CountedEvent::kCountMask;
          }},
     {.type = ObjectType::mutex,
      .name = "mutex",
      .value_form = "held by thread {}",
      .has_holder = true,
      .least_initial = 0,
      .most_initial = 0,
      .begin = [](ObjectEntry& entry, std::uint64_t /*none*/) noexcept { new (&entry.mutex) RobustMutex(); },
      .value = [](const ObjectEntry& entry) noexcept { return std::uint64_t{entry.mutex.owner()}; }}}};

/// Null: a newer host's type, or a stranger's number.
[[nodiscard]] constexpr const ObjectTraits* traits_of(ObjectType type) noexcept {
  const auto number = static_cast<std::size_t>(type);
  return number < kObjectTraits.size() ? &kObjectTraits.at(number) : nullptr;
}

[[nodiscard]] constexpr std::string_view to_string(ObjectType type) noexcept {
  const ObjectTraits* const traits = traits_of(type);
  return traits == nullptr ? std::string_view("unknown") : traits->name;
}

namespace detail {
[[nodiscard]] consteval bool are_by_number() {
  for (std::size_t number = 0; number < kObjectTraits.size(); ++number) {
    if (static_cast<std::size_t>(kObjectTraits.at(number).type) != number) return false;
  }
  return true;
}
}  // namespace detail
static_assert(detail::are_by_number());

}  // namespace plchost
