#include "shm/pool/pool_table.hpp"

#include <algorithm>

namespace plchost {

namespace {

constexpr auto kRelaxed = std::memory_order_relaxed;  // the mutex orders what it guards

std::uint32_t hash_of(std::string_view name) noexcept {
  std::uint32_t hash = 2166136261U;  // FNV-1a
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  return hash;
}

bool is_used(const ObjectEntry& entry) noexcept {
  return entry.state.load(std::memory_order_acquire) == static_cast<std::uint32_t>(EntryState::used);
}

void set_state(ObjectEntry& entry, EntryState state) noexcept {
  entry.state.store(static_cast<std::uint32_t>(state), std::memory_order_release);
}

}  // namespace

bool is_object_name(std::string_view name) noexcept {
  return !name.empty() && name.size() <= kMaxObjectName &&
         std::ranges::all_of(name, [](char c) { return c >= ' ' && c <= '~'; });
}

PoolTable::PoolTable(std::span<std::byte> memory, std::uint32_t max_objects) noexcept
    : header_(reinterpret_cast<PoolHeader*>(memory.data())),
      buckets_(reinterpret_cast<Link*>(memory.data() + sizeof(PoolHeader)), bucket_count_for(max_objects)),
      entries_(reinterpret_cast<ObjectEntry*>(memory.data() + entries_offset(max_objects)), max_objects) {}

bool PoolTable::is_valid(const ObjectEntry& entry) noexcept {
  return is_used(entry) && entry.type.load(kRelaxed) < static_cast<std::uint32_t>(ObjectType::free) &&
         is_object_name(entry.name.view());
}

std::span<ObjectEntry> PoolTable::entries() const noexcept {
  return entries_.first(std::min<std::size_t>(header_->high_water.load(kRelaxed), entries_.size()));
}

PoolTable::Link& PoolTable::bucket_of(std::string_view name) const noexcept {
  return buckets_[hash_of(name) & (buckets_.size() - 1)];
}

ObjectEntry* PoolTable::entry_at(std::uint32_t link) const noexcept {
  return link >= 1 && link <= entries_.size() ? &entries_[link - 1] : nullptr;
}

std::uint32_t PoolTable::link_of(const ObjectEntry& entry) const noexcept {
  return static_cast<std::uint32_t>(&entry - entries_.data()) + 1;
}

PoolTable::Link* PoolTable::walk(std::string_view name) const noexcept {
  Link& bucket = bucket_of(name);
  Link* link = &bucket;
  for (std::size_t step = 0; step <= entries_.size(); ++step) {
    const std::uint32_t value = link->load(kRelaxed);
    if (value == 0) return link;
    ObjectEntry* const entry = entry_at(value);
    if (entry == nullptr || !is_used(*entry)) return nullptr;
    const std::string_view found = entry->name.view();
    if (found == name) return link;
    if (&bucket_of(found) != &bucket) return nullptr;
    link = &entry->next;
  }
  return nullptr;
}

ObjectEntry* PoolTable::find(std::string_view name) noexcept {
  Link* link = walk(name);
  if (link == nullptr) {
    rebuild();
    link = walk(name);
  }
  return link == nullptr ? nullptr : entry_at(link->load(kRelaxed));
}

ObjectEntry* PoolTable::insert(std::string_view name, ObjectType type) noexcept {
  if (!free_places_are_sane()) rebuild();
  ObjectEntry* entry = allocate();
  if (entry == nullptr) entry = reclaim();
  if (entry == nullptr) return nullptr;
  entry->binding.store(Binding::next_generation(entry->binding.load(kRelaxed)), std::memory_order_release);
  entry->first_count.store(entry->event.count(), kRelaxed);
  entry->type.store(static_cast<std::uint32_t>(type), kRelaxed);
  entry->name.assign(name);
  // From here on a rebuild finds it, whether or not this process lives to put it into its chain.
  set_state(*entry, EntryState::used);
  Link& bucket = bucket_of(name);
  entry->next.store(bucket.load(kRelaxed), kRelaxed);
  bucket.store(link_of(*entry), kRelaxed);
  return entry;
}

bool PoolTable::free_places_are_sane() const noexcept {
  const std::uint32_t high_water = header_->high_water.load(kRelaxed);
  if (high_water > entries_.size()) return false;
  if (high_water < entries_.size() && is_used(entries_[high_water])) return false;
  const std::uint32_t first_free = header_->first_free.load(kRelaxed);
  if (first_free == 0) return true;
  const ObjectEntry* const entry = entry_at(first_free);
  return entry != nullptr && first_free <= high_water && !is_used(*entry);
}

ObjectEntry* PoolTable::allocate() noexcept {
  if (ObjectEntry* const entry = entry_at(header_->first_free.load(kRelaxed)); entry != nullptr) {
    header_->first_free.store(entry->next.load(kRelaxed), kRelaxed);
    return entry;
  }
  const std::uint32_t high_water = header_->high_water.load(kRelaxed);
  if (high_water >= entries_.size()) return nullptr;
  header_->high_water.store(high_water + 1, kRelaxed);
  return &entries_[high_water];
}

// The search goes on where the last one ended: an event that was made just now and is about to be bound is
// the last to be taken away.
ObjectEntry* PoolTable::reclaim() noexcept {
  const std::size_t start = header_->reclaim_hand.load(kRelaxed) % entries_.size();
  for (std::size_t step = 0; step < entries_.size(); ++step) {
    const std::size_t index = (start + step) % entries_.size();
    ObjectEntry& entry = entries_[index];
    std::uint64_t binding = entry.binding.load(std::memory_order_acquire);
    if (is_used(entry) && Binding::in_use(binding)) continue;
    // Fails if it is being registered or bound at this moment. With the new generation, old handles are
    // invalid.
    if (!entry.binding.compare_exchange_strong(binding, Binding::next_generation(binding),
                                               std::memory_order_acq_rel, kRelaxed)) {
      continue;
    }
    header_->reclaim_hand.store(static_cast<std::uint32_t>((index + 1) % entries_.size()), kRelaxed);
    if (!is_used(entry) || unlink(entry)) return &entry;
    rebuild();  // its chain was damaged; this has made a free place of it
    return allocate();
  }
  return nullptr;
}

bool PoolTable::unlink(ObjectEntry& entry) noexcept {
  Link* const link = walk(entry.name.view());
  const bool found = link != nullptr && link->load(kRelaxed) == link_of(entry);
  if (found) link->store(entry.next.load(kRelaxed), kRelaxed);
  set_state(entry, EntryState::free);
  return found;
}

void PoolTable::rebuild() noexcept {
  for (Link& bucket : buckets_) bucket.store(0, kRelaxed);
  std::uint32_t high_water = 0;
  std::uint32_t first_free = 0;
  // From the top down, so that the first one in use tells where the unused rest begins.
  for (std::size_t i = entries_.size(); i-- > 0;) {
    ObjectEntry& entry = entries_[i];
    if (is_valid(entry)) {
      if (high_water == 0) high_water = static_cast<std::uint32_t>(i + 1);
      Link& bucket = bucket_of(entry.name.view());
      entry.next.store(bucket.load(kRelaxed), kRelaxed);
      bucket.store(link_of(entry), kRelaxed);
      continue;
    }
    if (is_used(entry)) {
      entry.binding.store(Binding::next_generation(entry.binding.load(kRelaxed)), std::memory_order_release);
    }
    set_state(entry, EntryState::free);
    entry.next.store(first_free, kRelaxed);
    if (high_water != 0) first_free = link_of(entry);
  }
  header_->high_water.store(high_water, kRelaxed);
  header_->first_free.store(first_free, kRelaxed);
  header_->repairs.fetch_add(1, kRelaxed);
}

}  // namespace plchost
