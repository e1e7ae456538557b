#include "shm/block_driver/slot_ring.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "shm/base/crc32c.hpp"

namespace plchost {

namespace {

// Measured: from here on it costs less to write a block past the caches than the reader pays for taking it
// out of them, line by line.
constexpr std::size_t kPastCaches = 2048;

constexpr unsigned kSlotsBits = 16;
constexpr std::uint64_t kSlotsMask = (std::uint64_t{1} << kSlotsBits) - 1;

constexpr std::uint64_t position_word(std::uint64_t at, std::uint32_t slots) noexcept {
  return at << kSlotsBits | slots;
}

// A mark has two bits more, so two less of the position: it is unique for as long as a mark can be seen.
constexpr unsigned kStateBits = 2;
constexpr std::uint64_t kTaken = 1;
constexpr std::uint64_t kDone = 2;
constexpr std::uint64_t kStateMask = 3;

constexpr std::uint64_t mark_word(std::uint64_t at, std::uint32_t slots, std::uint64_t state) noexcept {
  return position_word(at, slots) << kStateBits | state;
}
constexpr bool is_mark_of(std::uint64_t mark, std::uint64_t at) noexcept {
  constexpr unsigned kShift = kSlotsBits + kStateBits;
  return (mark & kStateMask) != 0 && mark >> kShift == at << kShift >> kShift;
}
constexpr std::uint32_t slots_of_mark(std::uint64_t mark) noexcept {
  return static_cast<std::uint32_t>(mark >> kStateBits & kSlotsMask);
}

// Slots of the block that begins there; 0: none does, or what is written there is not the writer's.
std::uint32_t slots_at(const RingMemory& ring, std::uint64_t at) noexcept {
  const std::uint64_t word = ring.descriptors[at & (ring.slots - 1)].position.load(std::memory_order_acquire);
  const auto slots = static_cast<std::uint32_t>(word & kSlotsMask);
  return slots <= kMaxSlotsPerBlock && word == position_word(at, slots) ? slots : 0;
}

}  // namespace

std::uint64_t count_waiting(const RingMemory& ring) noexcept {
  const std::uint64_t begin = ring.head->load(std::memory_order_acquire);
  std::uint64_t count = 0;
  for (std::uint64_t at = begin; at - begin < ring.slots; ++count) {
    const std::uint32_t slots = slots_at(ring, at);
    if (slots == 0) break;
    at += slots;
  }
  return count;
}

// Whether the slots from `tail` on are free. The reader's word is looked at only if the last look does not
// suffice: it lies in a cache line that the reader writes.
RingWriter::Claim RingWriter::room_at(std::uint64_t tail, std::uint32_t slots) noexcept {
  // Acquire, here and below: pairs with the reader's release, so that it has done with the slots.
  std::uint64_t seen = head_seen_.load(std::memory_order_acquire);
  if (tail + slots - seen <= memory_.slots) return Claim::taken;
  const std::uint64_t head = memory_.head->load(std::memory_order_acquire);
  // It lies between what it was and where the tail is by now; anything else no reader has written.
  if (head - seen > tail_.load(std::memory_order_acquire) - seen) return Claim::broken;
  while (seen < head && !head_seen_.compare_exchange_weak(seen, head, std::memory_order_acq_rel,
                                                          std::memory_order_acquire)) {
  }
  return tail + slots - head <= memory_.slots ? Claim::taken : Claim::full;
}

bool RingWriter::has_room(std::uint32_t slots) noexcept {
  return room_at(tail_.load(std::memory_order_acquire), slots) == Claim::taken;
}

PutResult RingWriter::put(BlockHeader header, std::span<const std::byte> contents) noexcept {
  const std::uint32_t slots = slots_for(contents.size());
  std::uint64_t tail = tail_.load(std::memory_order_relaxed);
  for (;;) {
    const Claim claim = room_at(tail, slots);
    if (claim == Claim::taken) {
      if (tail_.compare_exchange_weak(tail, tail + slots, std::memory_order_acq_rel,
                                      std::memory_order_relaxed)) {
        break;
      }
      continue;
    }
    // Of a tail that others have moved on this says nothing.
    const std::uint64_t now = tail_.load(std::memory_order_relaxed);
    if (now == tail) return claim == Claim::full ? PutResult::full : PutResult::broken;
    tail = now;
  }
  const std::size_t ring_bytes = std::size_t{memory_.slots} * kSlotSize;
  const std::size_t begin = (tail & (memory_.slots - 1)) * kSlotSize;
  header.size = static_cast<std::uint32_t>(contents.size());
  std::uint32_t checksum = checksum_of(header);
  // Contents that reach the end of the ring go on at its beginning.
  const std::size_t first = std::min(contents.size(), ring_bytes - begin - sizeof header);
  const auto copy = contents.size() >= kPastCaches ? copy_out_with_crc32c : copy_with_crc32c;
  checksum = copy(memory_.bytes + begin + sizeof header, contents.first(first), checksum);
  if (first < contents.size()) checksum = copy(memory_.bytes, contents.subspan(first), checksum);
  header.checksum = checksum;
  std::memcpy(memory_.bytes + begin, &header, sizeof header);
  SlotDescriptor& descriptor = memory_.descriptors[tail & (memory_.slots - 1)];
  const BlockTag tag{.channel = header.channel, .destination = NodeAddress::from_number(header.destination)};
  descriptor.tag.store(tag.word(), std::memory_order_relaxed);
  // Release pairs with the acquire in look(): a reader that sees the position sees the block.
  descriptor.position.store(position_word(tail, slots), std::memory_order_release);
  memory_.published->fetch_add(1, std::memory_order_release);
  return PutResult::put;
}

RingReader::RingReader(const RingMemory& memory)
    : memory_(memory), marks_(std::make_unique<std::atomic<std::uint64_t>[]>(memory.slots)) {}

RingReader::Found RingReader::look(std::uint64_t at) const noexcept {
  Found found{.at = at};
  const std::uint64_t index = at & (memory_.slots - 1);
  found.mark = marks_[index].load(std::memory_order_acquire);
  if (is_mark_of(found.mark, at)) {
    found.mine = true;
    found.step = slots_of_mark(found.mark);
    return found;
  }
  const std::uint32_t slots = slots_at(memory_, at);
  // Not written yet, or not by the writer of this ring. A block may begin at any slot behind it.
  if (slots == 0) return found;
  found.step = slots;
  found.published = true;
  found.tag = BlockTag::from_word(memory_.descriptors[index].tag.load(std::memory_order_relaxed));
  return found;
}

bool RingReader::mark(const Found& found) noexcept {
  std::uint64_t before = found.mark;
  if (!marks_[found.at & (memory_.slots - 1)].compare_exchange_strong(
          before, mark_word(found.at, found.step, kTaken), std::memory_order_acq_rel,
          std::memory_order_relaxed)) {
    return false;  // another thread has it
  }
  // Had, freed and its place passed by while this thread stood between look() and here.
  if (found.at - head_.load(std::memory_order_acquire) < memory_.slots) return true;
  return false;
}

RingReader::Fetched RingReader::fetch(const Found& found, std::span<std::byte> buffer,
                                      BlockHeader& header) noexcept {
  const std::size_t ring_bytes = std::size_t{memory_.slots} * kSlotSize;
  const std::size_t begin = (found.at & (memory_.slots - 1)) * kSlotSize;
  std::memcpy(&header, memory_.bytes + begin, sizeof header);
  const bool sane = is_sane(header) && slots_for(header.size) == found.step &&
                    header.channel == found.tag.channel &&
                    header.destination == found.tag.destination.number();
  if (sane && header.size > buffer.size()) {
    marks_[found.at & (memory_.slots - 1)].store(found.mark, std::memory_order_release);
    return Fetched::too_small;
  }
  bool good = sane;
  if (good) {
    // The checksum is that of the copy, which no stranger can change any more.
    const std::size_t from = begin + sizeof header;
    const std::size_t first = std::min<std::size_t>(header.size, ring_bytes - from);
    std::uint32_t checksum = checksum_of(header);
    checksum = copy_with_crc32c(buffer.data(), {memory_.bytes + from, first}, checksum);
    checksum = copy_with_crc32c(buffer.data() + first, {memory_.bytes, header.size - first}, checksum);
    good = checksum == header.checksum;
  }
  release(found);
  if (good) return Fetched::good;
  damaged_.fetch_add(1, std::memory_order_relaxed);
  return Fetched::damaged;
}

void RingReader::release(const Found& found) noexcept {
  const std::uint64_t mask = memory_.slots - 1;
  taken_.fetch_add(1, std::memory_order_relaxed);
  memory_.descriptors[found.at & mask].position.store(0, std::memory_order_relaxed);
  // A thread that finds the block at the head done moves the head on, over all that are done. Of two threads
  // that are done at the same time, one must see the mark of the other: each stores its own before it loads
  // the other's. So these four are sequentially consistent.
  marks_[found.at & mask].store(mark_word(found.at, found.step, kDone), std::memory_order_seq_cst);
  std::uint64_t head = head_.load(std::memory_order_seq_cst);
  for (;;) {
    const std::uint64_t mark = marks_[head & mask].load(std::memory_order_seq_cst);
    if (!is_mark_of(mark, head) || (mark & kStateMask) != kDone) break;
    const std::uint64_t next = head + slots_of_mark(mark);
    if (head_.compare_exchange_strong(head, next, std::memory_order_seq_cst)) head = next;
  }
  // The head that the writer sees only grows. A thread that was interrupted before this line has an older
  // one, and stores nothing.
  std::uint64_t told = memory_.head->load(std::memory_order_relaxed);
  while (told < head && !memory_.head->compare_exchange_weak(told, head, std::memory_order_release,
                                                             std::memory_order_relaxed)) {
  }
}

std::uint64_t RingReader::end_of_published() const noexcept {
  const std::uint64_t head = this->head();
  std::uint64_t end = head;
  for (std::uint64_t at = head; at < head + memory_.slots;) {
    const Found found = look(at);
    at += found.step;
    if (found.published) end = at;
  }
  return end;
}

std::uint32_t RingReader::drop_until(std::uint64_t end) noexcept {
  std::uint32_t dropped = 0;
  for (std::uint64_t at = head(); at < end;) {
    const Found found = look(at);
    at += found.step;
    if (!found.published || !mark(found)) continue;
    release(found);
    ++dropped;
  }
  return dropped;
}

}  // namespace plchost
