#include "shm/pool/pool_references.hpp"

namespace plchost {

namespace {

std::uint32_t generation_of(const ObjectEntry& object) noexcept {
  return Binding::generation(object.binding.load(kRelaxed));
}

}  // namespace

void PoolReferences::count_up(std::atomic<std::uint32_t>& count) noexcept {
  journal_.set(count, count.load(kRelaxed) + 1);
}

void PoolReferences::count_down(std::atomic<std::uint32_t>& count) noexcept {
  if (const std::uint32_t before = count.load(kRelaxed); before > 0) journal_.set(count, before - 1);
}

ReferenceEntry* PoolReferences::add(ObjectEntry& object, ClientSlot& client, bool writable) noexcept {
  ReferenceEntry* const reference = allocate();
  if (reference == nullptr) return nullptr;
  reference->generation.fetch_add(1, kRelaxed);
  reference->client.store(view_.link_to(client), kRelaxed);
  reference->client_generation.store(client.generation.load(kRelaxed), kRelaxed);
  reference->object_generation.store(generation_of(object), kRelaxed);
  reference->writable.store(writable ? 1 : 0, kRelaxed);
  reference->waiting.store(0, kRelaxed);
  journal_.set(reference->object, view_.link_to(object));
  count_up(object.reference_count);
  count_up(client.reference_count);
  return reference;
}

ObjectEntry* PoolReferences::release(ReferenceEntry& reference) noexcept {
  ObjectEntry* const object = view_.object_of(reference);
  if (object != nullptr) count_down(object->reference_count);
  if (ClientSlot* const client = view_.client_of(reference)) count_down(client->reference_count);
  free(reference);
  return object;
}

ReferenceEntry* PoolReferences::allocate() noexcept {
  PoolHeader& header = view_.header();
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (ReferenceEntry* const free = view_.reference(header.first_free_reference); free != nullptr) {
      journal_.set(header.first_free_reference, free->next_free.load(kRelaxed));
      if (free->object.load(kRelaxed) == 0) return free;
      rebuild();  // the free list is damaged
      continue;
    }
    const std::uint32_t high_water = header.reference_high_water.load(kRelaxed);
    if (high_water >= view_.references().size()) {
      if (is_full()) return nullptr;
      rebuild();  // a stranger has written over the high water, the free list, or the count of a dead client
      continue;
    }
    ReferenceEntry& unused = view_.references()[high_water];
    if (unused.object.load(kRelaxed) == 0) {
      journal_.set(header.reference_high_water, high_water + 1);
      return &unused;
    }
    rebuild();
  }
  return nullptr;
}

// By the counts of the clients, which are few: a full table is not searched by each call that it refuses.
bool PoolReferences::is_full() const noexcept {
  std::uint64_t held = 0;
  for (const ClientSlot& client : view_.clients()) {
    if (client.pid.load(kRelaxed) != 0) held += client.reference_count.load(kRelaxed);
  }
  return held >= view_.references().size();
}

void PoolReferences::free(ReferenceEntry& reference) noexcept {
  Link& first_free = view_.header().first_free_reference;
  journal_.set(reference.object, 0);
  journal_.set(reference.next_free, first_free.load(kRelaxed));
  journal_.set(first_free, view_.link_to(reference));
}

void PoolReferences::rebuild() noexcept {
  PoolHeader& header = view_.header();
  journal_.commit();
  const std::uint32_t before = header.rebuilding.exchange(1, kRelaxed);
  for (ObjectEntry& object : view_.entries()) {
    object.reference_count.store(0, kRelaxed);
  }
  for (ClientSlot& client : view_.clients()) {
    client.reference_count.store(0, kRelaxed);
  }
  const auto all = view_.references();
  header.first_free_reference.store(0, kRelaxed);
  header.reference_high_water.store(0, kRelaxed);
  for (std::size_t i = all.size(); i-- > 0;) {
    ReferenceEntry& reference = all[i];
    ObjectEntry* const object = view_.object_of(reference);
    ClientSlot* const client = view_.client_of(reference);
    const bool used = object != nullptr && object->state.load(kRelaxed) != 0 && client != nullptr &&
                      client->pid.load(kRelaxed) != 0;
    if (used) {
      if (header.reference_high_water.load(kRelaxed) == 0) {
        header.reference_high_water.store(static_cast<std::uint32_t>(i + 1), kRelaxed);
      }
      count_up(object->reference_count);
      count_up(client->reference_count);
    } else if (header.reference_high_water.load(kRelaxed) != 0) {
      free(reference);
    } else {
      reference.object.store(0, kRelaxed);
    }
  }
  journal_.commit();
  header.rebuilds.fetch_add(1, kRelaxed);
  header.rebuilding.store(before, std::memory_order_release);
}

}  // namespace plchost
