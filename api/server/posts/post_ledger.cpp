#include "api/server/posts/post_ledger.hpp"

#include <new>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

#include "shm/base/robust_mutex.hpp"
#include "shm/base/time.hpp"

namespace plchost {

namespace {

/// The post that is being made. One for all sources, since posts are made one after the other.
struct PostIntent {
  std::atomic<std::uint32_t> pending{0};  // 1: the rest counts; written last
  std::atomic<std::uint32_t> entry{0};
  std::atomic<std::uint32_t> next{0};   // of the entry's states: counts once the post is made
  std::atomic<std::uint32_t> place{0};  // of the event in the pool
  std::atomic<std::uint32_t> mark{0};   // of the event once the post is made
};

struct LedgerLayout {
  std::uint64_t magic;  // written last
  std::uint32_t version;
  std::uint32_t entry_size;
  std::uint64_t pool_file;  // the number of the pool's file: an intent is of that pool
  RobustMutex mutex;        // held by the process that has the ledger, as long as it has it
  PostIntent intent;
  PostCounters forgotten;  // of the sources whose entries were given away
  std::array<LedgerEntry, kLedgerEntries> entries;
};

constexpr std::uint64_t kMagic = 0x31'74'73'6f'70'63'6c'70;  // "plcpost1"
constexpr std::uint32_t kVersion = 3;
/// A process that was killed takes up to this to end.
constexpr Duration kLockPatience = std::chrono::seconds(5);

/// What was stored before this is in memory before what is stored after it, at a kill, too.
void keep_order() noexcept {
  std::atomic_thread_fence(std::memory_order_release);
}

LedgerLayout& layout_of(const MemoryFile& memory) {
  return *reinterpret_cast<LedgerLayout*>(memory.bytes().data());  // made with this layout
}

bool is_ours(const LedgerLayout& layout) {
  return layout.magic == kMagic && layout.version == kVersion && layout.entry_size == sizeof(LedgerEntry);
}

}  // namespace

void PostCounters::add(const PostCounters& other) noexcept {
  received += other.received;
  accepted += other.accepted;
  no_task += other.no_task;
  rejected += other.rejected;
  duplicate += other.duplicate;
  early += other.early;
  lost += other.lost;
  malformed += other.malformed;
}

std::string PostLedger::file_name(std::string_view pool) {
  return fmt::format("{}.posts", pool);
}

Result<PostLedger> PostLedger::open(const ObjectPool& pool) {
  const std::string name = file_name(pool.name());
  auto memory = MemoryFile::open(name, sizeof(LedgerLayout), MemoryFile::Access::read_write);
  if (!memory || !is_ours(layout_of(*memory))) {
    memory = MemoryFile::replace(name, sizeof(LedgerLayout));
    if (!memory) return failure_in("open the ledger of posts", memory.error());
    LedgerLayout& layout = layout_of(*memory);
    layout.version = kVersion;
    layout.entry_size = sizeof(LedgerEntry);
    std::atomic_ref(layout.magic).store(kMagic, std::memory_order_release);
  }
  const LockResult locked = layout_of(*memory).mutex.lock(MonotonicClock::now() + kLockPatience);
  if (locked != LockResult::locked && locked != LockResult::owner_died) {
    return failure(ErrorCode::busy, fmt::format("the ledger of posts '{}' is in use by thread {}; end the "
                                                "API server that has it",
                                                name, layout_of(*memory).mutex.owner()));
  }
  return PostLedger(std::move(*memory), pool);
}

PostLedger::PostLedger(MemoryFile memory, const ObjectPool& pool) : memory_(std::move(memory)), pool_(&pool) {
  finish_intent();
  const std::span all(entries(), kLedgerEntries);
  for (std::uint32_t i = 0; i < kLedgerEntries; ++i) {
    if (all[i].in_use.load(std::memory_order_acquire) == 0) continue;
    index_[dds::Guid{all[i].source}] = i;
    next_free_ = i + 1;
  }
}

PostLedger::~PostLedger() {
  if (memory_) layout_of(memory_).mutex.unlock();
}

// What steps 3 and 4 of a post have to do, if the process before this one was killed over it.
void PostLedger::finish_intent() noexcept {
  LedgerLayout& layout = layout_of(memory_);
  const PostIntent& intent = layout.intent;
  struct stat file = {};
  const bool known = ::stat(MemoryFile::path(pool_->name()).c_str(), &file) == 0;
  const bool same_pool = known && layout.pool_file == file.st_ino;
  const bool pending = intent.pending.load(std::memory_order_acquire) != 0;
  const std::uint32_t entry = intent.entry.load(std::memory_order_relaxed);
  CountedEvent* const event = pool_->event_at(intent.place.load(std::memory_order_relaxed));
  if (pending && same_pool && entry < kLedgerEntries && event != nullptr &&
      event->snapshot().marked() == (intent.mark.load(std::memory_order_relaxed) != 0)) {
    layout.entries[entry].current.store(intent.next.load(std::memory_order_relaxed),
                                        std::memory_order_release);
    event->nudge();
  }
  drop_intent();
  layout.pool_file = file.st_ino;
}

void PostLedger::set(LedgerEntry& entry, const SourceState& state) noexcept {
  const std::uint32_t next = 1U - (entry.current.load(std::memory_order_relaxed) & 1U);
  keep_order();
  entry.states[next] = state;
  entry.current.store(next, std::memory_order_release);
}

void PostLedger::begin_post(const LedgerEntry& entry, const PoolEvent& event) noexcept {
  keep_order();
  PostIntent& intent = layout_of(memory_).intent;
  intent.entry.store(static_cast<std::uint32_t>(&entry - entries()), std::memory_order_relaxed);
  intent.next.store(1U - (entry.current.load(std::memory_order_relaxed) & 1U), std::memory_order_relaxed);
  intent.place.store(pool_->place_of(event), std::memory_order_relaxed);
}

void PostLedger::write_intent(LedgerEntry& entry, const SourceState& after,
                              CountedEvent::Snapshot seen) noexcept {
  PostIntent& intent = layout_of(memory_).intent;
  entry.states[intent.next.load(std::memory_order_relaxed) & 1U] = after;
  intent.mark.store(seen.marked() ? 0 : 1, std::memory_order_relaxed);
  intent.pending.store(1, std::memory_order_release);
}

void PostLedger::end_post(LedgerEntry& entry, CountedEvent& event, CountedEvent::Snapshot made) noexcept {
  entry.current.store(layout_of(memory_).intent.next.load(std::memory_order_relaxed),
                      std::memory_order_release);
  event.wake(made);
  drop_intent();
}

void PostLedger::drop_intent() noexcept {
  layout_of(memory_).intent.pending.store(0, std::memory_order_release);
}

LedgerEntry* PostLedger::entries() const noexcept {
  return layout_of(memory_).entries.data();
}

PostCounters PostLedger::total() const noexcept {
  PostCounters sum = layout_of(memory_).forgotten;
  for_each([&sum](const LedgerEntry& entry) { sum.add(entry.state().counters); });
  return sum;
}

const LedgerEntry* PostLedger::find(const dds::Guid& source) const {
  const auto known = index_.find(source);
  return known == index_.end() ? nullptr : &entries()[known->second];
}

LedgerEntry& PostLedger::entry_for(const dds::Guid& source, std::int64_t now_ns) {
  if (const auto known = index_.find(source); known != index_.end()) {
    LedgerEntry& entry = entries()[known->second];
    entry.used_ns = now_ns;
    return entry;
  }
  std::uint32_t chosen = next_free_;
  if (chosen < kLedgerEntries) {
    ++next_free_;
  } else {
    chosen = 0;
    for (std::uint32_t i = 1; i < kLedgerEntries; ++i) {
      if (entries()[i].used_ns < entries()[chosen].used_ns) chosen = i;
    }
    layout_of(memory_).forgotten.add(entries()[chosen].state().counters);
    index_.erase(dds::Guid{entries()[chosen].source});
    ++reused_;
  }
  LedgerEntry& entry = entries()[chosen];
  entry.in_use.store(0, std::memory_order_release);
  entry.~LedgerEntry();
  new (&entry) LedgerEntry{};
  entry.source = source.bytes;
  entry.used_ns = now_ns;
  entry.in_use.store(1, std::memory_order_release);
  index_[source] = chosen;
  return entry;
}

}  // namespace plchost
