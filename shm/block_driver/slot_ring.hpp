#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "shm/block_driver/block.hpp"

namespace plchost {

/// A block lies in slots that follow each other: its header, then its contents.
inline constexpr std::size_t kSlotSize = 256;
[[nodiscard]] constexpr std::uint32_t slots_for(std::size_t size) noexcept {
  return static_cast<std::uint32_t>((sizeof(BlockHeader) + size + kSlotSize - 1) / kSlotSize);
}
inline constexpr std::uint32_t kMaxSlotsPerBlock = slots_for(kMaxBlockSize);

/// Slots of a ring, a power of two: one largest block and as much again fit into the smallest.
inline constexpr std::uint32_t kMinRingSlots = 512;
inline constexpr std::uint32_t kMaxRingSlots = 16384;
[[nodiscard]] constexpr bool is_ring_size(std::uint32_t slots) noexcept {
  return slots >= kMinRingSlots && slots <= kMaxRingSlots && std::has_single_bit(slots);
}

/// A reader's knowledge of a block that it has not touched.
struct BlockTag {
  std::uint32_t channel = 0;
  NodeAddress destination;

  [[nodiscard]] constexpr std::uint64_t word() const noexcept {
    return std::uint64_t{channel} << 32 | destination.number();
  }
  [[nodiscard]] static constexpr BlockTag from_word(std::uint64_t word) noexcept {
    return {.channel = static_cast<std::uint32_t>(word >> 32),
            .destination = NodeAddress::from_number(static_cast<std::uint32_t>(word))};
  }
};

/// Written for the first slot of a block, `position` last.
struct SlotDescriptor {
  std::atomic<std::uint64_t> position;  ///< [ which slot since the ring began : 48 ][ slots : 16 ]; 0: none
  std::atomic<std::uint64_t> tag;       ///< a BlockTag
};
static_assert(sizeof(SlotDescriptor) == 16);

/// The parts of a ring as they lie in shared memory; all zero is an empty ring.
struct RingMemory {
  std::atomic<std::uint64_t>* head = nullptr;       ///< reader: all slots before it are free
  std::atomic<std::uint64_t>* published = nullptr;  ///< writer: blocks so far; a hint where to look
  SlotDescriptor* descriptors = nullptr;
  std::byte* bytes = nullptr;  ///< kSlotSize for each slot
  std::uint32_t slots = 0;     ///< is_ring_size()
};

/// Blocks that lie in a row from the head on, as a process that only looks sees them. Any context.
[[nodiscard]] std::uint64_t count_waiting(const RingMemory& ring) noexcept;

enum class PutResult : std::uint8_t {
  put,
  full,    ///< no room; nothing was put
  broken,  ///< the reader's end is impossible: a stranger wrote there
};

/// The end at which blocks are put in: one process, any number of its threads at once. A thread takes its
/// slots with one compare-and-swap and then fills them; another one may overtake it meanwhile. So a thread
/// that is interrupted, or has a long block, delays no other. All functions are real-time.
class RingWriter {
 public:
  explicit RingWriter(const RingMemory& memory) noexcept : memory_(memory) {}

  /// Sets size and checksum of the header. `contents`: at most kMaxBlockSize bytes.
  PutResult put(BlockHeader header, std::span<const std::byte> contents) noexcept;
  /// Whether so many slots could be had now.
  [[nodiscard]] bool has_room(std::uint32_t slots) noexcept;

 private:
  enum class Claim : std::uint8_t { taken, full, broken };
  Claim room_at(std::uint64_t tail, std::uint32_t slots) noexcept;

  RingMemory memory_;
  // In this process only: a stranger cannot reach it, so it need not be checked.
  alignas(64) std::atomic<std::uint64_t> tail_{0};
  std::atomic<std::uint64_t> head_seen_{0};
};

enum class TakeResult : std::uint8_t {
  none,       ///< nothing that was asked for
  taken,      ///< header and contents are there
  too_small,  ///< the buffer is; the block waits on, the header tells its size
};

/// The end at which blocks are taken out: one process, any number of its threads at once, each of which takes
/// what is for it. A block goes to the thread that marks it, in memory of this process, with one
/// compare-and-swap; unmarked blocks do not hinder those behind them. All functions are
/// real-time but for the constructor.
class RingReader {
 public:
  explicit RingReader(const RingMemory& memory);

  /// The oldest block whose tag `wants(tag, slots)` accepts: copied to the beginning of `buffer`, its slots
  /// freed. Blocks that turn out to be damaged are dropped and counted.
  template <class Wants>
  TakeResult take(Wants&& wants, std::span<std::byte> buffer, BlockHeader& header) noexcept {
    std::int64_t unseen = waiting();
    const std::uint64_t end = head() + memory_.slots;
    for (std::uint64_t at = end - memory_.slots; at < end;) {
      const Found found = look(at);
      at += found.step;
      if (found.mine) continue;
      if (!found.published) {
        // The end, unless a slower thread of the writer's has left a hole here and there is more behind it.
        if (unseen <= 0) break;
        continue;
      }
      --unseen;
      if (!wants(found.tag, found.step) || !mark(found)) continue;
      const Fetched fetched = fetch(found, buffer, header);
      if (fetched == Fetched::good) return TakeResult::taken;
      if (fetched == Fetched::too_small) return TakeResult::too_small;
    }
    return TakeResult::none;
  }

  /// Drops all blocks before `end` that were not taken. Returns their number.
  std::uint32_t drop_until(std::uint64_t end) noexcept;

  /// Blocks in the ring that were not taken, as the writer says; may be wrong for a moment.
  [[nodiscard]] std::int64_t waiting() const noexcept {
    return static_cast<std::int64_t>(memory_.published->load(std::memory_order_acquire) -
                                     taken_.load(std::memory_order_relaxed));
  }
  /// The first slot that is not free, and the end of the last block that can be seen.
  [[nodiscard]] std::uint64_t head() const noexcept { return head_.load(std::memory_order_acquire); }
  [[nodiscard]] std::uint64_t end_of_published() const noexcept;
  /// Whether something seems to be there to take.
  [[nodiscard]] bool waits() const noexcept { return waiting() > 0 || head_is_published(); }
  /// Whether a block begins at the head that can be taken.
  [[nodiscard]] bool head_is_published() const noexcept { return look(head()).published; }
  /// Whether a thread of this process has the block at the head.
  [[nodiscard]] bool head_is_taken() const noexcept { return look(head()).mine; }

  [[nodiscard]] std::uint64_t taken() const noexcept { return taken_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t damaged() const noexcept { return damaged_.load(std::memory_order_relaxed); }

 private:
  /// The contents of a slot. `step` leads to the next one to look at.
  struct Found {
    std::uint64_t at = 0;
    std::uint32_t step = 1;
    bool published = false;  ///< a block begins there, and it is not marked
    bool mine = false;       ///< a thread of this process has marked it
    BlockTag tag = {};
    std::uint64_t mark = 0;
  };
  enum class Fetched : std::uint8_t { good, damaged, too_small };

  [[nodiscard]] Found look(std::uint64_t at) const noexcept;
  bool mark(const Found& found) noexcept;
  Fetched fetch(const Found& found, std::span<std::byte> buffer, BlockHeader& header) noexcept;
  void release(const Found& found) noexcept;

  RingMemory memory_;
  // In this process only, as the writer's tail.
  std::unique_ptr<std::atomic<std::uint64_t>[]> marks_;  // [ slot : 46 ][ slots : 16 ][ 1 taken, 2 done ]
  alignas(64) std::atomic<std::uint64_t> head_{0};
  std::atomic<std::uint64_t> taken_{0};
  std::atomic<std::uint64_t> damaged_{0};
};

}  // namespace plchost
