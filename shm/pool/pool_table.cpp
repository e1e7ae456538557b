#include "shm/pool/pool_table.hpp"

#include <algorithm>
#include <new>

#include "shm/base/time.hpp"

namespace plchost {

namespace {

std::uint32_t hash_of(std::string_view name) noexcept {
  std::uint32_t hash = 2166136261U;  // FNV-1a
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  return hash;
}

bool is_taken(const ObjectEntry& entry) noexcept {
  return entry.state.load(std::memory_order_acquire) != static_cast<std::uint32_t>(EntryState::free);
}

// Old handles on what was there are invalid from here on.
void begin_generation(ObjectEntry& entry) noexcept {
  entry.binding.store(Binding::next_generation(entry.binding.load(kRelaxed)), std::memory_order_release);
}

Link& bucket_of(const PoolView& view, std::string_view name) noexcept {
  return view.buckets()[hash_of(name) & (view.buckets().size() - 1)];
}

// The link that leads to the entry, or the last one (that holds 0) of the chain. Null: the chain is damaged.
Link* walk(const PoolView& view, std::string_view name) noexcept {
  Link& bucket = bucket_of(view, name);
  Link* link = &bucket;
  for (std::size_t step = 0; step <= view.entries().size(); ++step) {
    if (link->load(kRelaxed) == 0) return link;
    ObjectEntry* const entry = view.entry(*link);
    if (entry == nullptr || !is_taken(*entry)) return nullptr;
    const std::string_view found = entry->name.view();
    if (found == name) return link;
    if (&bucket_of(view, found) != &bucket) return nullptr;
    link = &entry->next;
  }
  return nullptr;
}

}  // namespace

bool PoolTable::is_valid(const ObjectEntry& entry) noexcept {
  return entry.state.load(std::memory_order_acquire) == static_cast<std::uint32_t>(EntryState::used) &&
         entry.type.load(kRelaxed) < kObjectTypes && is_object_name(entry.name.view());
}

bool PoolTable::is_idle(const ObjectEntry& entry) noexcept {
  const std::uint32_t attributes = entry.attributes.load(kRelaxed);
  if ((attributes & kKept) != 0 || entry.reference_count.load(kRelaxed) != 0) return false;
  const std::uint64_t binding = entry.binding.load(std::memory_order_acquire);
  return (attributes & kDirect) != 0 ? Binding::bound(binding) == 0 : !Binding::in_use(binding);
}

void PoolTable::set_state(ObjectEntry& entry, EntryState state) noexcept {
  journal_.set(entry.state, static_cast<std::uint32_t>(state));
}

void PoolTable::put(ObjectEntry& entry, Link& first) noexcept {
  journal_.set(entry.next, first.load(kRelaxed));
  journal_.set(first, view_.link_to(entry));
}

ObjectEntry* PoolTable::peek(const PoolView& view, std::string_view name) noexcept {
  const Link* const link = walk(view, name);
  ObjectEntry* const entry = link == nullptr ? nullptr : view.entry(*link);
  return entry != nullptr && is_valid(*entry) ? entry : nullptr;
}

ObjectEntry* PoolTable::find(std::string_view name) noexcept {
  if (walk(view_, name) == nullptr) rebuild();
  return peek(view_, name);
}

ObjectEntry* PoolTable::insert(std::string_view name, ObjectType type) noexcept {
  if (!free_places_are_sane()) rebuild();
  ObjectEntry* entry = allocate();
  if (entry == nullptr && reclaim()) entry = allocate();
  if (entry == nullptr) return nullptr;
  begin_generation(*entry);
  // The count and the mark go on: a poster that was killed over the event before is told by them.
  entry->first_count.store(entry->event.set_taken(false).count(), kRelaxed);
  entry->size.store(0, kRelaxed);
  entry->type.store(static_cast<std::uint32_t>(type), kRelaxed);
  entry->attributes.store(0, kRelaxed);
  entry->reference_count.store(0, kRelaxed);
  entry->made_unix_ns.store(unix_time_ns(), kRelaxed);
  entry->name.assign(name);
  set_state(*entry, EntryState::changing);
  put(*entry, bucket_of(view_, name));
  journal_.set(view_.header().unsettled, view_.link_to(*entry));
  journal_.commit();
  return entry;
}

void PoolTable::publish(ObjectEntry& entry) noexcept {
  set_state(entry, EntryState::used);
  journal_.set(view_.header().unsettled, 0);
}

void PoolTable::withdraw(ObjectEntry& entry) noexcept {
  set_state(entry, EntryState::changing);
  journal_.set(view_.header().unsettled, view_.link_to(entry));
  journal_.commit();
}

void PoolTable::erase(ObjectEntry& entry) noexcept {
  begin_generation(entry);
  Link* const link = walk(view_, entry.name.view());
  const bool found = link != nullptr && link->load(kRelaxed) == view_.link_to(entry);
  if (found) journal_.set(*link, entry.next.load(kRelaxed));
  set_state(entry, EntryState::free);
  journal_.set(view_.header().unsettled, 0);
  if (found) put(entry, view_.header().first_free);
  journal_.commit();
  if (!found) rebuild();  // its chain was damaged; this makes a free place of it
}

bool PoolTable::free_places_are_sane() const noexcept {
  const auto all = view_.entries();
  const std::uint32_t high_water = view_.header().high_water.load(kRelaxed);
  if (high_water > all.size()) return false;
  if (high_water < all.size() && is_taken(all[high_water])) return false;
  const Link& first_free = view_.header().first_free;
  if (first_free.load(kRelaxed) == 0) return true;
  const ObjectEntry* const entry = view_.entry(first_free);
  return entry != nullptr && !is_taken(*entry) && view_.link_to(*entry) <= high_water;
}

ObjectEntry* PoolTable::allocate() noexcept {
  PoolHeader& header = view_.header();
  if (ObjectEntry* const entry = view_.entry(header.first_free); entry != nullptr) {
    journal_.set(header.first_free, entry->next.load(kRelaxed));
    return entry;
  }
  const std::uint32_t high_water = header.high_water.load(kRelaxed);
  if (high_water >= view_.entries().size()) return nullptr;
  journal_.set(header.high_water, high_water + 1);
  return &view_.entries()[high_water];
}

// The search goes on where the last one ended: an event that was made just now and is about to be bound is
// the last to be taken away.
bool PoolTable::reclaim() noexcept {
  const auto all = view_.entries();
  Link& hand = view_.header().reclaim_hand;
  const std::size_t start = hand.load(kRelaxed) % all.size();
  for (std::size_t step = 0; step < all.size(); ++step) {
    const std::size_t index = (start + step) % all.size();
    ObjectEntry& entry = all[index];
    std::uint64_t binding = entry.binding.load(std::memory_order_acquire);
    if (is_taken(entry) && !is_idle(entry)) continue;
    // Fails if it is being registered or bound at this moment. With the new generation, old handles are
    // invalid.
    if (!entry.binding.compare_exchange_strong(binding, Binding::next_generation(binding),
                                               std::memory_order_acq_rel, kRelaxed)) {
      continue;
    }
    hand.store(static_cast<std::uint32_t>((index + 1) % all.size()), kRelaxed);
    if (is_taken(entry)) {
      erase(entry);
    } else {
      rebuild();  // free, and not where the free ones are
    }
    return true;
  }
  return false;
}

void PoolTable::rebuild() noexcept {
  PoolHeader& header = view_.header();
  journal_.commit();
  const std::uint32_t before = header.rebuilding.exchange(1, kRelaxed);
  for (Link& bucket : view_.buckets()) bucket.store(0, kRelaxed);
  std::uint32_t high_water = 0;
  std::uint32_t first_free = 0;
  const auto all = view_.entries();
  // From the top down, so that the first one in use tells where the unused rest begins.
  for (std::size_t i = all.size(); i-- > 0;) {
    ObjectEntry& entry = all[i];
    if (is_valid(entry)) {
      if (high_water == 0) high_water = static_cast<std::uint32_t>(i + 1);
      Link& bucket = bucket_of(view_, entry.name.view());
      entry.next.store(bucket.load(kRelaxed), kRelaxed);
      bucket.store(view_.link_to(entry), kRelaxed);
      continue;
    }
    if (is_taken(entry)) {
      begin_generation(entry);
      header.lost_objects.fetch_add(1, kRelaxed);
    }
    entry.state.store(static_cast<std::uint32_t>(EntryState::free), std::memory_order_release);
    entry.next.store(first_free, kRelaxed);
    if (high_water != 0) first_free = view_.link_to(entry);
  }
  header.high_water.store(high_water, kRelaxed);
  header.first_free.store(first_free, kRelaxed);
  header.rebuilds.fetch_add(1, kRelaxed);
  header.rebuilding.store(before, std::memory_order_release);
}

}  // namespace plchost
