#include "shm/block_driver/block_link.hpp"

#include <fmt/format.h>

#include "shm/files/fixed_page.hpp"
#include "shm/files/pool_files.hpp"

namespace plchost {

namespace {

constexpr PageKind kLinkKind{
    .what = "link between nodes", .magic = 0x6b6e696c'6b6c6270, .version = 2};  // "pblklink"

LinkLayout& layout_of(const MemoryFile& file) noexcept {
  return *reinterpret_cast<LinkLayout*>(file.bytes().data());
}

}  // namespace

std::string link_name(std::string_view pool, std::string_view base, std::uint16_t from, std::uint16_t to) {
  return pool_memory_name(pool, fmt::format("{}.{}.{}", base, from, to));
}

Result<LinkMemory> LinkMemory::make(const std::string& name, const NodeLife& from, const NodeLife& to,
                                    std::uint32_t slots) {
  const auto fill = [&](std::span<std::byte> bytes) -> Result<void> {
    auto& layout = *reinterpret_cast<LinkLayout*>(bytes.data());
    layout.slots = slots;
    layout.from = from.node;
    layout.to = to.node;
    layout.from_generation = from.generation;
    layout.to_generation = to.generation;
    describe_page(layout, kLinkKind, bytes.size());
    return {};
  };
  PLCHOST_TRY_ASSIGN(auto file,
                     in_step("link between nodes", MemoryFile::replace(name, link_size(slots), fill)));
  return LinkMemory(std::move(file), slots);
}

Result<LinkMemory> LinkMemory::open(const std::string& name, MemoryFile::Access access) {
  PLCHOST_TRY_ASSIGN(auto file,
                     in_step("link between nodes", open_page<LinkLayout>(name, kLinkKind, access)));
  const LinkLayout& layout = layout_of(file);
  const std::uint32_t slots = layout.slots;
  if (!is_ring_size(slots) || file.bytes().size() != link_size(slots)) {
    return failure(ErrorCode::corrupt, fmt::format("link between nodes '{}' says {} slots; this does not fit "
                                                   "its size of {} bytes",
                                                   name, slots, file.bytes().size()));
  }
  return LinkMemory(std::move(file), slots);
}

Result<LinkMemory> LinkMemory::open(const std::string& name, const NodeLife& from, const NodeLife& to) {
  auto memory = open(name, MemoryFile::Access::read_write);
  if (!memory) return memory;
  const LinkLayout& layout = memory->layout();
  if (layout.from != from.node || layout.to != to.node || layout.from_generation != from.generation ||
      layout.to_generation != to.generation) {
    return failure(ErrorCode::wrong_state,
                   fmt::format("link '{}' was made for other processes than those that use it now", name));
  }
  return memory;
}

Result<LinkMemory> LinkMemory::open_to_read(const std::string& name) {
  return open(name, MemoryFile::Access::read_only);
}

LinkLayout& LinkMemory::layout() const noexcept {
  return layout_of(file_);
}

RingMemory LinkMemory::ring(std::size_t priority) const noexcept {
  LinkLayout& link = layout();
  std::byte* const descriptors = file_.bytes().data() + sizeof(LinkLayout);
  const std::size_t descriptors_of_ring = slots_ * sizeof(SlotDescriptor);
  std::byte* const slots = descriptors + kBlockPriorities * descriptors_of_ring;
  return {.head = &link.heads[priority],
          .published = &link.published[priority],
          .descriptors = reinterpret_cast<SlotDescriptor*>(descriptors + priority * descriptors_of_ring),
          .bytes = slots + priority * slots_ * kSlotSize,
          .slots = slots_};
}

LinkCounts LinkMemory::counts() const noexcept {
  const LinkLayout& link = layout();
  LinkCounts counts{.sent_bytes = link.sent_bytes.load(std::memory_order_relaxed),
                    .received = link.received.load(std::memory_order_relaxed),
                    .damaged = link.damaged.load(std::memory_order_relaxed),
                    .expired = link.expired.load(std::memory_order_relaxed)};
  for (std::size_t priority = 0; priority < kBlockPriorities; ++priority) {
    counts.sent += link.published[priority].load(std::memory_order_relaxed);
    counts.congested += link.congested[priority].load(std::memory_order_relaxed);
    counts.waiting += count_waiting(ring(priority));
  }
  return counts;
}

OutLink::OutLink(LinkMemory memory, const NodeLife& to) noexcept
    : memory_(std::move(memory)),
      to_(to),
      rings_{RingWriter(memory_.ring(0)), RingWriter(memory_.ring(1)), RingWriter(memory_.ring(2)),
             RingWriter(memory_.ring(3))} {}

PutResult OutLink::put(const BlockHeader& header, std::span<const std::byte> contents) noexcept {
  const PutResult result = rings_[header.priority].put(header, contents);
  if (result == PutResult::put) {
    memory_.layout().sent_bytes.fetch_add(contents.size(), std::memory_order_relaxed);
  } else if (result == PutResult::full) {
    memory_.layout().congested[header.priority].fetch_add(1, std::memory_order_relaxed);
  } else if (result == PutResult::broken) {
    refused_.store(true, std::memory_order_relaxed);
  }
  return result;
}

bool OutLink::has_room(std::uint8_t priority, std::uint32_t slots) noexcept {
  return rings_[priority].has_room(slots);
}

bool OutLink::broken() const noexcept {
  return refused_.load(std::memory_order_relaxed) || memory_.lost() ||
         memory_.layout().broken.load(std::memory_order_relaxed) != 0;
}

InLink::InLink(LinkMemory memory, const NodeLife& from)
    : memory_(std::move(memory)),
      from_(from),
      rings_{RingReader(memory_.ring(0)), RingReader(memory_.ring(1)), RingReader(memory_.ring(2)),
             RingReader(memory_.ring(3))},
      progress_{} {}

bool InLink::empty() const noexcept {
  for (const RingReader& ring : rings_) {
    if (ring.end_of_published() != ring.head()) return false;
  }
  return true;
}

bool InLink::waits() const noexcept {
  for (const RingReader& ring : rings_) {
    if (ring.waits()) return true;
  }
  return false;
}

std::uint32_t InLink::tidy(TimePoint now, Duration hold) noexcept {
  std::uint32_t dropped = 0;
  std::uint64_t taken = 0;
  std::uint64_t damaged = 0;
  for (std::size_t priority = 0; priority < rings_.size(); ++priority) {
    dropped += tidy_ring(priority, now, hold);
    taken += rings_[priority].taken();
    damaged += rings_[priority].damaged();
  }
  expired_ += dropped;
  LinkLayout& layout = memory_.layout();
  layout.received.store(taken - damaged - expired_, std::memory_order_relaxed);
  layout.damaged.store(damaged, std::memory_order_relaxed);
  layout.expired.store(expired_, std::memory_order_relaxed);
  if (memory_.lost()) layout.broken.store(1, std::memory_order_relaxed);
  return dropped;
}

std::uint32_t InLink::drop_all() noexcept {
  std::uint32_t dropped = 0;
  for (RingReader& ring : rings_) dropped += ring.drop_until(ring.end_of_published());
  return dropped;
}

// A block at the head stands in the way of all others. If nobody takes it, it is dropped with all that came
// before now. Or it is not there. Then the sender has reserved its slots and never filled them, a thread here
// has taken it and never given it back, or another program has written over it.
std::uint32_t InLink::tidy_ring(std::size_t priority, TimePoint now, Duration hold) noexcept {
  RingReader& ring = rings_[priority];
  Progress& progress = progress_[priority];
  const std::uint64_t head = ring.head();
  const std::uint64_t end = ring.waits() ? ring.end_of_published() : head;
  // The sender counts blocks that are nowhere to be seen: somebody has wiped them out.
  const bool unseen = end == head && ring.waits() && !ring.head_is_taken();
  if ((end == head && !unseen) || head != progress.head || progress.since == TimePoint{}) {
    progress = {.head = head, .end = end, .since = now};
    return 0;
  }
  if (now - progress.since < hold) return 0;
  if (!ring.head_is_published()) memory_.layout().broken.store(1, std::memory_order_relaxed);
  const std::uint32_t dropped = ring.drop_until(progress.end);
  progress.since = TimePoint{};
  return dropped;
}

}  // namespace plchost
