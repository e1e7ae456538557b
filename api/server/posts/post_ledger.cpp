#include "api/server/posts/post_ledger.hpp"

#include <new>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

#include "shm/base/time.hpp"
#include "shm/files/fixed_page.hpp"
#include "shm/threads/robust_mutex.hpp"

namespace plchost {

namespace {

struct LedgerLayout {
  std::uint64_t magic;  // written last
  std::uint32_t version;
  std::uint32_t size;
  std::uint64_t pool_file;  // the number of the pool's file: an intent is of that pool
  RobustMutex mutex;        // held by the process that has the ledger, as long as it has it
  PostIntent intent;
  PostCounters forgotten;  // of the sources whose entries were given away
  std::array<LedgerEntry, kLedgerEntries> entries;
};

constexpr PageKind kLedgerKind{.what = "ledger of posts",
                               .magic = 0x31'74'73'6f'70'63'6c'70,  // "plcpost1"
                               .version = 5};                       // 5: its whole size in the head
/// A process that was killed takes up to this to end.
constexpr Duration kLockPatience = std::chrono::seconds(5);

// Instances are in the group of the server, and trusted for pages of their own only.
PageRights servers_page() {
  return {.owners = is_own_or_roots, .memory = {.mode = 0600}};
}

LedgerLayout& layout_of(const MemoryFile& memory) {
  return *reinterpret_cast<LedgerLayout*>(memory.bytes().data());  // made with this layout
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
  PLCHOST_TRY_ASSIGN(auto memory,
                     in_step("cannot open the ledger of posts",
                             open_or_make_page<LedgerLayout>(name, kLedgerKind, Replaces::anything,
                                                             leave_empty<LedgerLayout>, servers_page())));
  // A version before has let its group write it.
  (void)::chmod(MemoryFile::path(name).c_str(), servers_page().memory.mode);
  const LockResult locked = layout_of(memory).mutex.lock(MonotonicClock::now() + kLockPatience);
  if (locked != LockResult::locked && locked != LockResult::owner_died) {
    return failure(ErrorCode::busy, fmt::format("the ledger of posts '{}' is in use by thread {}; end the "
                                                "API server that has it",
                                                name, layout_of(memory).mutex.owner()));
  }
  return PostLedger(std::move(memory), pool);
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

// An intent of another pool is about an event that is gone.
void PostLedger::finish_intent() noexcept {
  LedgerLayout& layout = layout_of(memory_);
  struct stat file = {};
  const bool known = ::stat(MemoryFile::path(pool_->name()).c_str(), &file) == 0;
  if (known && layout.pool_file == file.st_ino) {
    layout.intent.finish(
        [&](std::uint32_t entry) { return entry < kLedgerEntries ? &layout.entries[entry].kept : nullptr; },
        [&](std::uint32_t event) { return pool_->event_at(event); });
  } else {
    layout.intent.drop();
  }
  layout.pool_file = file.st_ino;
}

void PostLedger::set(LedgerEntry& entry, const SourceState& state) noexcept {
  entry.kept.set(state);
}

void PostLedger::set_audited(const dds::Guid& source, std::uint64_t accepted) noexcept {
  const auto known = index_.find(source);
  if (known != index_.end()) entries()[known->second].audited = static_cast<std::uint32_t>(accepted);
}

PostIntent& PostLedger::intent() const noexcept {
  return layout_of(memory_).intent;
}

PostIntent::Place PostLedger::place_of(const LedgerEntry& entry, const PoolEvent& event) const noexcept {
  return {.entry = static_cast<std::uint32_t>(&entry - entries()), .event = pool_->place_of(event)};
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
