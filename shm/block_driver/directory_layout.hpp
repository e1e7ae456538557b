#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "shm/base/counted_event.hpp"
#include "shm/base/names.hpp"
#include "shm/base/seqlock.hpp"
#include "shm/block_driver/node_address.hpp"
#include "shm/files/fixed_page.hpp"
#include "shm/threads/process_start.hpp"

// The directory of the nodes of a pool as it lies in shared memory. All values read here are checked before
// they are used: strangers may have scribbled in it. It is written under a lock of its file, which the kernel
// gives back when its holder ends.

namespace plchost {

inline constexpr PageKind kDirectoryKind{.what = "directory of nodes",
                                         .magic = 0x65646f6e'6b6c6270,  // "pblknode"
                                         .version = 3};

/// Other hosts that are reached through a node: from first to last. first 0: none.
struct HostRange {
  std::uint16_t first = 0;
  std::uint16_t last = 0;
  bool operator==(const HostRange&) const = default;
};
inline constexpr std::size_t kMaxHostRanges = 16;

/// The owner of an address.
struct NodeRecord {
  FixedText<kMaxInstanceName> name;  ///< kept when the node goes: it gets the same address again
  ProcessIdentity process;           ///< pid 0: the address is free
  std::uint32_t generation = 0;      ///< of the last node that had it
  std::uint32_t forwards = 0;        ///< 1: blocks between others may go through it
  std::uint32_t queue_slots = 0;     ///< of the links that it makes
  std::array<HostRange, kMaxHostRanges> hosts{};
  /// NodeLocks::file() in which the process has locked its address. Another number: its program is of a
  /// version that locked nothing, and left whatever it had in these bytes.
  std::uint32_t locks_file = 0;
};
static_assert(sizeof(NodeRecord) == 128);

/// The counts of a node, besides those of its links.
struct NodeCounters {
  std::atomic<std::uint64_t> forwarded;    ///< blocks that went through it
  std::atomic<std::uint64_t> no_route;     ///< had to be dropped: nothing leads to their destination
  std::atomic<std::uint64_t> loops;        ///< had been here before, or came too far
  std::atomic<std::uint64_t> duplicates;   ///< of a block for all nodes, that came on a second way
  std::atomic<std::uint64_t> congested;    ///< had to be dropped: the next queue was full
  std::atomic<std::uint64_t> expired;      ///< blocks that were not taken in time
  std::atomic<std::uint64_t> unconnected;  ///< sent when there was no link yet
  std::atomic<std::uint64_t> refused;      ///< a gateway's: came from another host and were not valid
  std::atomic<std::uint64_t> lost;         ///< a gateway's: were on their way between hosts and never came
};

struct NodeSlot {
  /// Posted for each block for this node. Written by all senders.
  alignas(64) CountedEvent arrivals;
  /// Posted when its router has something to do.
  alignas(64) CountedEvent work;
  /// Bit of each node that has made a link to this one.
  std::array<std::atomic<std::uint64_t>, kMaxNodes / 64> incoming;
  // Written by the node.
  alignas(64) std::array<std::atomic<std::uint64_t>, kMaxNodes / 64> neighbours;  ///< that it talks to
  NodeCounters counters;
  Seqlock<NodeRecord> record;
};

struct DirectoryLayout {
  std::uint64_t magic = 0;
  std::uint32_t version = 0;
  std::uint32_t slot_count = 0;
  std::uint64_t size = 0;
  std::atomic<std::uint64_t> changes;      ///< grows when a node comes, goes or changes its neighbours
  std::atomic<std::uint32_t> host_number;  ///< of this host, for others; 0: there is no gateway
  std::array<NodeSlot, kMaxNodes> slots;
};
static_assert(offsetof(DirectoryLayout, slots) == 64 && sizeof(NodeSlot) % 64 == 0);

}  // namespace plchost
