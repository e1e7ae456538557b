#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "shm/base/time.hpp"
#include "shm/block_driver/slot_ring.hpp"
#include "shm/files/memory_file.hpp"

namespace plchost {

/// One run of a node's process: an address is given again, with the next generation.
struct NodeLife {
  std::uint16_t node = 0;
  std::uint32_t generation = 0;
  bool operator==(const NodeLife&) const = default;
};

/// A link as it lies in shared memory: the queues of one direction between one run of each of two nodes.
/// Nothing in it is ever repaired. When one of the two ends, or finds that a stranger has written into it, a
/// fresh one takes its place, so that nothing can stay stuck in it.
struct LinkLayout {
  std::uint64_t magic = 0;
  std::uint32_t version = 0;
  std::uint32_t slots = 0;  ///< of each ring
  std::uint64_t size = 0;   ///< of the whole link, bytes
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  std::uint32_t from_generation = 0;
  std::uint32_t to_generation = 0;

  // Written by the sender. One for each priority.
  alignas(64) std::array<std::atomic<std::uint64_t>, kBlockPriorities> published;
  std::atomic<std::uint64_t> sent_bytes;                                           ///< of contents
  alignas(64) std::array<std::atomic<std::uint64_t>, kBlockPriorities> congested;  ///< blocks without room

  // Written by the receiver.
  alignas(64) std::array<std::atomic<std::uint64_t>, kBlockPriorities> heads;
  std::array<std::atomic<std::uint64_t>, 3> reserved;
  std::atomic<std::uint32_t> broken;  ///< not 0: it asks for a fresh link
  alignas(64) std::atomic<std::uint64_t> received;
  std::atomic<std::uint64_t> damaged;  ///< blocks whose checksum or header was wrong
  std::atomic<std::uint64_t> expired;  ///< blocks that were not taken in time
  // SlotDescriptor descriptors[kBlockPriorities][slots] and then the slots' bytes follow.
};
static_assert(sizeof(LinkLayout) == 320 && offsetof(LinkLayout, published) == 64);
static_assert(offsetof(LinkLayout, heads) == 192 && offsetof(LinkLayout, received) == 256);

/// The counts of a link, of all priorities, since it was made. The receiver tells its counts ten times in the
/// time that a block may wait.
struct LinkCounts {
  std::uint64_t sent = 0;
  std::uint64_t sent_bytes = 0;
  std::uint64_t waiting = 0;    ///< blocks that lie in the queues now
  std::uint64_t congested = 0;  ///< could not be sent: no room
  std::uint64_t received = 0;
  std::uint64_t damaged = 0;
  std::uint64_t expired = 0;
};

[[nodiscard]] constexpr std::size_t link_size(std::uint32_t slots) noexcept {
  return sizeof(LinkLayout) + kBlockPriorities * std::size_t{slots} * (sizeof(SlotDescriptor) + kSlotSize);
}

/// The file of the link between two nodes of that base name.
[[nodiscard]] std::string link_name(std::string_view pool, std::string_view base, std::uint16_t from,
                                    std::uint16_t to);

/// A link mapped into this process.
class LinkMemory {
 public:
  /// Makes a fresh one that takes the place of any before. Set-up.
  [[nodiscard]] static Result<LinkMemory> make(const std::string& name, const NodeLife& from,
                                               const NodeLife& to, std::uint32_t slots);
  /// The one that was made for just these two runs. not_found: there is none. corrupt: it is something else.
  /// wrong_state: it was made for other runs. Set-up.
  [[nodiscard]] static Result<LinkMemory> open(const std::string& name, const NodeLife& from,
                                               const NodeLife& to);
  /// The link of that name, of any node, to look at.
  [[nodiscard]] static Result<LinkMemory> open_to_read(const std::string& name);

  [[nodiscard]] LinkLayout& layout() const noexcept;
  [[nodiscard]] RingMemory ring(std::size_t priority) const noexcept;
  /// Any context; looks at each block that waits.
  [[nodiscard]] LinkCounts counts() const noexcept;
  /// The file was cut short by a stranger, and what is read has been zeros since. Any context.
  [[nodiscard]] bool lost() const noexcept { return file_.lost(); }
  /// Whether it is the same link, opened twice.
  [[nodiscard]] bool is(const LinkMemory& other) const noexcept { return file_.same_file(other.file_); }

 private:
  static Result<LinkMemory> open(const std::string& name, MemoryFile::Access access);
  LinkMemory(MemoryFile file, std::uint32_t slots) noexcept : file_(std::move(file)), slots_(slots) {}

  MemoryFile file_;
  std::uint32_t slots_;  // as validated: a stranger may change the link's own
};

/// The sender's end of a link.
class OutLink {
 public:
  OutLink(LinkMemory memory, const NodeLife& to) noexcept;

  /// Real-time, any thread of the process. Full queues are counted.
  PutResult put(const BlockHeader& header, std::span<const std::byte> contents) noexcept;
  [[nodiscard]] bool has_room(std::uint8_t priority, std::uint32_t slots) noexcept;
  /// Whether a fresh one has to take its place. Any context.
  [[nodiscard]] bool broken() const noexcept;
  [[nodiscard]] const NodeLife& to() const noexcept { return to_; }

 private:
  LinkMemory memory_;
  NodeLife to_;
  std::atomic<bool> refused_{false};
  std::array<RingWriter, kBlockPriorities> rings_;
};

/// The receiver's end of a link.
class InLink {
 public:
  InLink(LinkMemory memory, const NodeLife& from);

  /// Real-time, any thread of the process; see RingReader::take().
  template <class Wants>
  TakeResult take(std::size_t priority, Wants&& wants, std::span<std::byte> buffer,
                  BlockHeader& header) noexcept {
    return rings_[priority].take(std::forward<Wants>(wants), buffer, header);
  }
  /// Drops what has waited for longer than `hold`, and asks for a fresh link if one is needed. To be called
  /// in turns of about a tenth of `hold`, by one thread. Blocks dropped.
  std::uint32_t tidy(TimePoint now, Duration hold) noexcept;
  /// Drops all blocks that were not taken: the link is given up. Returns their number.
  std::uint32_t drop_all() noexcept;
  /// Whether there is nothing left to take. Looks at each slot.
  [[nodiscard]] bool empty() const noexcept;
  /// Whether something seems to be there to take. Cheap.
  [[nodiscard]] bool waits() const noexcept;
  [[nodiscard]] const NodeLife& from() const noexcept { return from_; }
  [[nodiscard]] bool uses(const LinkMemory& memory) const noexcept { return memory_.is(memory); }

 private:
  struct Progress {
    std::uint64_t head = 0;
    std::uint64_t end = 0;
    TimePoint since;
  };
  std::uint32_t tidy_ring(std::size_t priority, TimePoint now, Duration hold) noexcept;

  LinkMemory memory_;
  NodeLife from_;
  std::array<RingReader, kBlockPriorities> rings_;
  std::array<Progress, kBlockPriorities> progress_;
  std::uint64_t expired_ = 0;
};

}  // namespace plchost
