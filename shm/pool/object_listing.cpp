#include "shm/pool/object_listing.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "shm/pool/pool_mutex.hpp"
#include "shm/pool/pool_segment.hpp"

namespace plchost {

auto ObjectHolders::look_at(const PoolView& view, std::size_t from, std::size_t count) -> Part {
  Part part;
  const auto used = view.used_references();
  const std::size_t begin = std::min(from, used.size());
  for (const ReferenceEntry& reference : used.subspan(begin, std::min(count, used.size() - begin))) {
    const ObjectEntry* const object = view.object_of(reference);
    const ClientSlot* const client = view.client_of(reference);
    if (object == nullptr || client == nullptr) continue;
    part.emplace_back(key_of(view, *object), ReferenceInfo{.pid = client->pid.load(kRelaxed),
                                                           .program = std::string(client->name.view()),
                                                           .writable = reference.writable.load(kRelaxed) != 0,
                                                           .waiting = reference.waiting.load(kRelaxed),
                                                           .start = client->start.load(kRelaxed),
                                                           .image = client->image.load(kRelaxed)});
  }
  return part;
}

void ObjectHolders::add(Part part) {
  for (auto& [key, info] : part) {
    std::vector<ReferenceInfo>& infos = of_[key];
    if (infos.size() < kMostReferencesTold) infos.push_back(std::move(info));
  }
}

ObjectHolders ObjectHolders::of(const PoolView& view, const ObjectEntry& object) {
  ObjectHolders holders;
  std::uint32_t left = object.reference_count.load(kRelaxed);
  for (std::size_t at = 0; at < view.used_references().size() && left > 0; ++at) {
    if (!view.is_on(view.references()[at], object)) continue;
    holders.add(look_at(view, at, 1));
    --left;
  }
  return holders;
}

std::vector<ReferenceInfo> ObjectHolders::find(const PoolView& view, const ObjectEntry& object) const {
  const auto found = of_.find(key_of(view, object));
  return found == of_.end() ? std::vector<ReferenceInfo>() : found->second;
}

std::uint64_t ObjectHolders::key_of(const PoolView& view, const ObjectEntry& object) noexcept {
  return std::uint64_t{view.link_to(object)} << 32U | Binding::generation(object.binding.load(kRelaxed));
}

ObjectInfo describe_object(const PoolView& view, const ObjectEntry& entry, const ObjectHolders& holders,
                           bool across) {
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
                  .references = holders.find(view, entry),
                  .reference_count = entry.reference_count.load(kRelaxed)};
  if (across && type == ObjectType::mutex) {
    const ClientMutex& mutex = PoolMutex::across(entry.mutex);
    info.value = mutex.thread();
    info.holder = info.value != 0 ? mutex.client() : 0;
  }
  for (const ReferenceInfo& reference : info.references) info.waiters += reference.waiting;
  return info;
}

// The kernel is asked once for each process.
void number_as_seen(const PoolSegment& segment, std::span<ObjectInfo> objects) {
  if (!segment.across_containers()) return;
  std::map<std::uint64_t, pid_t> known;
  for (ObjectInfo& object : objects) {
    for (ReferenceInfo& reference : object.references) {
      const auto [seen, is_new] = known.try_emplace(reference.start, 0);
      if (is_new) seen->second = segment.seen_as(reference.start);
      reference.pid = static_cast<std::uint32_t>(seen->second);
    }
  }
}

}  // namespace plchost
