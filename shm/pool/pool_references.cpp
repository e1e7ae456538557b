#include "shm/pool/pool_references.hpp"

namespace plchost {

namespace {

std::uint32_t generation_of(const ObjectEntry& object) noexcept {
  return Binding::generation(object.binding.load(kRelaxed));
}

}  // namespace

void PoolReferences::count_down(std::atomic<std::uint32_t>& count) noexcept {
  if (const std::uint32_t before = count.load(kRelaxed); before > 0) journal_.set(count, before - 1);
}

ObjectEntry* PoolReferences::object_of(const ReferenceEntry& reference) const noexcept {
  ObjectEntry* const object = view_.entry(reference.object);
  const bool same = object != nullptr && reference.object_generation.load(kRelaxed) == generation_of(*object);
  return same ? object : nullptr;
}

ReferenceEntry* PoolReferences::add(ObjectEntry& object, ClientSlot& client, bool writable) noexcept {
  ReferenceEntry* const reference = allocate();
  if (reference == nullptr) return nullptr;
  reference->generation.fetch_add(1, kRelaxed);
  reference->client.store(view_.link_to(client), kRelaxed);
  reference->object_generation.store(generation_of(object), kRelaxed);
  reference->writable.store(writable ? 1 : 0, kRelaxed);
  reference->waiting.store(0, kRelaxed);
  journal_.set(reference->object, view_.link_to(object));
  link(*reference, object, client);
  return reference;
}

void PoolReferences::link(ReferenceEntry& reference, ObjectEntry& object, ClientSlot& client) noexcept {
  const std::uint32_t self = view_.link_to(reference);
  const auto put_first = [&](Link& first, std::atomic<std::uint32_t>& count, Link ReferenceEntry::* next,
                             Link ReferenceEntry::* previous) {
    ReferenceEntry* const second = view_.reference(first);
    journal_.set(reference.*next, second == nullptr ? 0 : view_.link_to(*second));
    journal_.set(reference.*previous, 0);
    if (second != nullptr) journal_.set(second->*previous, self);
    journal_.set(first, self);
    journal_.set(count, count.load(kRelaxed) + 1);
  };
  put_first(object.first_reference, object.reference_count, &ReferenceEntry::next_of_object,
            &ReferenceEntry::previous_of_object);
  put_first(client.first_reference, client.reference_count, &ReferenceEntry::next_of_client,
            &ReferenceEntry::previous_of_client);
}

bool PoolReferences::unlink(ReferenceEntry& reference, Link& first, Link ReferenceEntry::* next,
                            Link ReferenceEntry::* previous) noexcept {
  const std::uint32_t self = view_.link_to(reference);
  ReferenceEntry* const before = view_.reference(reference.*previous);
  ReferenceEntry* const after = view_.reference(reference.*next);
  Link& from = before == nullptr ? first : before->*next;
  const bool sound =
      from.load(kRelaxed) == self &&
      (after == nullptr ? (reference.*next).load(kRelaxed) == 0 : (after->*previous).load(kRelaxed) == self);
  if (!sound) return false;
  journal_.set(from, (reference.*next).load(kRelaxed));
  if (after != nullptr) journal_.set(after->*previous, (reference.*previous).load(kRelaxed));
  return true;
}

ObjectEntry* PoolReferences::release(ReferenceEntry& reference) noexcept {
  ObjectEntry* const object = object_of(reference);
  ClientSlot* const client = view_.client(reference.client);
  // Of an object that was taken away under its users nobody has a list any more.
  const bool sound =
      client != nullptr &&
      (object == nullptr || unlink(reference, object->first_reference, &ReferenceEntry::next_of_object,
                                   &ReferenceEntry::previous_of_object)) &&
      unlink(reference, client->first_reference, &ReferenceEntry::next_of_client,
             &ReferenceEntry::previous_of_client);
  if (sound) {
    if (object != nullptr) count_down(object->reference_count);
    count_down(client->reference_count);
    free(reference);
  } else {
    reference.object.store(0, kRelaxed);
    rebuild();
  }
  return object;
}

ReferenceEntry* PoolReferences::allocate() noexcept {
  PoolHeader& header = view_.header();
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (ReferenceEntry* const free = view_.reference(header.first_free_reference); free != nullptr) {
      journal_.set(header.first_free_reference, free->next_of_object.load(kRelaxed));
      if (free->object.load(kRelaxed) == 0) return free;
      rebuild();  // the free list is damaged
      continue;
    }
    const std::uint32_t high_water = header.reference_high_water.load(kRelaxed);
    if (high_water >= view_.references().size()) return nullptr;
    ReferenceEntry& unused = view_.references()[high_water];
    if (unused.object.load(kRelaxed) == 0) {
      journal_.set(header.reference_high_water, high_water + 1);
      return &unused;
    }
    rebuild();
  }
  return nullptr;
}

void PoolReferences::free(ReferenceEntry& reference) noexcept {
  Link& first_free = view_.header().first_free_reference;
  journal_.set(reference.object, 0);
  journal_.set(reference.next_of_object, first_free.load(kRelaxed));
  journal_.set(first_free, view_.link_to(reference));
}

void PoolReferences::rebuild() noexcept {
  PoolHeader& header = view_.header();
  journal_.commit();
  const std::uint32_t before = header.rebuilding.exchange(1, kRelaxed);
  for (ObjectEntry& object : view_.entries()) {
    object.first_reference.store(0, kRelaxed);
    object.reference_count.store(0, kRelaxed);
  }
  for (ClientSlot& client : view_.clients()) {
    client.first_reference.store(0, kRelaxed);
    client.reference_count.store(0, kRelaxed);
  }
  const auto all = view_.references();
  header.first_free_reference.store(0, kRelaxed);
  header.reference_high_water.store(0, kRelaxed);
  for (std::size_t i = all.size(); i-- > 0;) {
    ReferenceEntry& reference = all[i];
    ObjectEntry* const object = object_of(reference);
    ClientSlot* const client = view_.client(reference.client);
    const bool used = object != nullptr && object->state.load(kRelaxed) != 0 && client != nullptr &&
                      client->pid.load(kRelaxed) != 0;
    if (used) {
      if (header.reference_high_water.load(kRelaxed) == 0) {
        header.reference_high_water.store(static_cast<std::uint32_t>(i + 1), kRelaxed);
      }
      link(reference, *object, *client);
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
