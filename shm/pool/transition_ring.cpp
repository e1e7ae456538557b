#include "shm/pool/transition_ring.hpp"

#include <cstddef>
#include <new>

#include <fmt/format.h>

#include "shm/base/time.hpp"
#include "shm/pool/fixed_page.hpp"

namespace plchost {

namespace {

constexpr PageKind kTransitionsKind{.what = "ring of transitions",
                                    .magic = 0x676e6972'6e617274,  // "tranring"
                                    .version = 1};                 // 1: first

static_assert(offsetof(TransitionRingLayout, version) == 8 && sizeof(Transition) == 232);

TransitionRingLayout& ring_layout_of(const MemoryFile& memory) noexcept {
  return *reinterpret_cast<TransitionRingLayout*>(memory.bytes().data());
}

Result<MemoryFile> open_ring(const std::string& name, MemoryFile::Access access) {
  return open_fixed_page<TransitionRingLayout>(name, kTransitionsKind, access);
}

Result<void> fill_ring(std::span<std::byte> bytes) {
  auto* const ring = new (bytes.data()) TransitionRingLayout;
  ring->version = kTransitionsKind.version;
  ring->size = sizeof(TransitionRingLayout);
  ring->stream_unix_ns = unix_time_ns();
  ring->magic = kTransitionsKind.magic;
  return {};
}

}  // namespace

std::string_view to_string(TransitionSource source) noexcept {
  switch (source) {
    case TransitionSource::application:
      return "application";
    case TransitionSource::process:
      return "process";
  }
  return "unknown";
}

std::string transition_ring_name(std::string_view pool, std::string_view instance) {
  return fmt::format("{}.transitions.{}", pool, instance);
}

Result<TransitionRing> TransitionRing::open(std::string_view pool, std::string_view instance) {
  const std::string name = transition_ring_name(pool, instance);
  auto memory = open_ring(name, MemoryFile::Access::read_write);
  if (!memory && memory.error().code == ErrorCode::not_found) {
    memory = MemoryFile::create(name, sizeof(TransitionRingLayout), fill_ring);
    // Another process was faster.
    if (!memory && memory.error().code == ErrorCode::already_exists) {
      memory = open_ring(name, MemoryFile::Access::read_write);
    }
  } else if (!memory) {  // nothing of ours
    memory = MemoryFile::replace(name, sizeof(TransitionRingLayout), fill_ring);
  }
  if (!memory) return std::unexpected(std::move(memory).error());
  return TransitionRing(*std::move(memory));
}

void TransitionRing::remove(std::string_view pool, std::string_view instance) noexcept {
  MemoryFile::remove(transition_ring_name(pool, instance));
}

// Each number has its slot, so two writers never write the same one, unless one of them stands still in here
// while the other goes through the whole ring: then a reader sees a number that is not the slot's.
void TransitionRing::add(TransitionSource source, std::uint32_t from, std::uint32_t to, std::int32_t pid,
                         std::string_view reason) noexcept {
  TransitionRingLayout& ring = ring_layout_of(memory_);
  Transition transition{.sequence = ring.last.fetch_add(1, std::memory_order_acq_rel) + 1,
                        .time_unix_ns = unix_time_ns(),
                        .time_monotonic_ns = MonotonicClock::now().time_since_epoch().count(),
                        .source = source,
                        .from = from,
                        .to = to,
                        .pid = pid,
                        .reason = {}};
  transition.reason.assign(reason);
  auto& slot = ring.slots[transition.sequence % kTransitionsKept];
  slot.recover();
  slot.write(transition);
}

Result<TransitionRingReader> TransitionRingReader::open(std::string_view pool, std::string_view instance) {
  auto memory = open_ring(transition_ring_name(pool, instance), MemoryFile::Access::read_only);
  if (!memory) return std::unexpected(std::move(memory).error());
  return TransitionRingReader(*std::move(memory));
}

std::int64_t TransitionRingReader::stream_unix_ns() const noexcept {
  return ring_layout_of(memory_).stream_unix_ns;
}

std::optional<Transition> TransitionRingReader::next(TimePoint now) noexcept {
  const TransitionRingLayout& ring = ring_layout_of(memory_);
  for (;;) {
    const std::uint64_t last = ring.last.load(std::memory_order_acquire);
    if (next_ > last) return std::nullopt;
    if (last - next_ >= kTransitionsKept) next_ = last - kTransitionsKept + 1;
    const auto found = ring.slots[next_ % kTransitionsKept].read();
    const bool written = found && found->sequence == next_;
    if (!written) {
      if (!waits_since_) waits_since_ = now;
      if (now - *waits_since_ < kWriterGone) return std::nullopt;
    }
    waits_since_.reset();
    ++next_;
    if (written) return found;
  }
}

}  // namespace plchost
