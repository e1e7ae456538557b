#include "api/server/posts/post_ledger.hpp"

#include <new>
#include <span>
#include <utility>

#include <fmt/format.h>

namespace plchost {

namespace {

struct LedgerLayout {
  std::uint64_t magic;  // written last
  std::uint32_t version;
  std::uint32_t entry_size;
  PostCounters forgotten;  // of the sources whose entries were given away
  std::array<LedgerEntry, kLedgerEntries> entries;
};

constexpr std::uint64_t kMagic = 0x31'74'73'6f'70'63'6c'70;  // "plcpost1"
constexpr std::uint32_t kVersion = 2;

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
}

std::string PostLedger::file_name(std::string_view pool) {
  return fmt::format("{}.posts", pool);
}

Result<PostLedger> PostLedger::open(std::string_view pool) {
  const std::string name = file_name(pool);
  auto known = MemoryFile::open(name, sizeof(LedgerLayout), MemoryFile::Access::read_write);
  if (known && is_ours(layout_of(*known))) return PostLedger(std::move(*known));
  auto made = MemoryFile::replace(name, sizeof(LedgerLayout));
  if (!made) return failure_in("open the ledger of posts", made.error());
  LedgerLayout& layout = layout_of(*made);
  layout.version = kVersion;
  layout.entry_size = sizeof(LedgerEntry);
  std::atomic_ref(layout.magic).store(kMagic, std::memory_order_release);
  return PostLedger(std::move(*made));
}

PostLedger::PostLedger(MemoryFile memory) : memory_(std::move(memory)) {
  const std::span all(entries(), kLedgerEntries);
  for (std::uint32_t i = 0; i < kLedgerEntries; ++i) {
    if (all[i].in_use.load(std::memory_order_acquire) == 0) continue;
    index_[dds::Guid{all[i].source}] = i;
    next_free_ = i + 1;
  }
}

LedgerEntry* PostLedger::entries() const noexcept {
  return layout_of(memory_).entries.data();
}

PostCounters PostLedger::total() const noexcept {
  PostCounters sum = layout_of(memory_).forgotten;
  for_each([&sum](const LedgerEntry& entry) { sum.add(entry.counters); });
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
    layout_of(memory_).forgotten.add(entries()[chosen].counters);
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
