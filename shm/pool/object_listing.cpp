#include "shm/pool/object_listing.hpp"

#include <algorithm>

namespace plchost {

namespace {

std::vector<ReferenceInfo> references_of(const PoolView& view, const ObjectEntry& entry) {
  std::vector<ReferenceInfo> infos;
  const ReferenceEntry* reference = view.reference(entry.first_reference);
  for (std::uint32_t step = 0; reference != nullptr && step < kMostReferencesTold; ++step) {
    const ClientSlot* const client = view.client(reference->client);
    if (client != nullptr) {
      infos.push_back({.pid = client->pid.load(kRelaxed),
                       .program = std::string(client->name.view()),
                       .writable = reference->writable.load(kRelaxed) != 0,
                       .waiting = reference->waiting.load(kRelaxed)});
    }
    reference = view.reference(reference->next_of_object);
  }
  return infos;
}

}  // namespace

ObjectInfo describe_object(const PoolView& view, const ObjectEntry& entry) {
  const auto type = static_cast<ObjectType>(entry.type.load(kRelaxed));
  const ObjectTraits* const traits = traits_of(type);
  const std::uint64_t binding = entry.binding.load(std::memory_order_acquire);
  ObjectInfo info{.name = std::string(entry.name.view()),
                  .type = type,
                  .value = traits != nullptr ? traits->value(entry) : 0,
                  .size = entry.size.load(kRelaxed),
                  .registered = Binding::registered(binding),
                  .bound_tasks = Binding::bound(binding),
                  .waiters = Binding::bound(binding),
                  .kept = (entry.attributes.load(kRelaxed) & kKept) != 0,
                  .owner = entry.owner.load(kRelaxed),
                  .group = entry.group.load(kRelaxed),
                  .mode = entry.mode.load(kRelaxed),
                  .made_unix_ns = entry.made_unix_ns.load(kRelaxed),
                  .references = references_of(view, entry),
                  .reference_count = entry.reference_count.load(kRelaxed)};
  for (const ReferenceInfo& reference : info.references) info.waiters += reference.waiting;
  return info;
}

}  // namespace plchost
