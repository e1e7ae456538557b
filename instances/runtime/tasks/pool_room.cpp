#include "instances/runtime/tasks/pool_room.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

// Its process's references go with it, and so do registrations and tasks of its own events.
bool stays(const ObjectInfo& object, std::string_view prefix, pid_t process) {
  const bool held_by_others = object.reference_count > object.references.size() ||
                              std::ranges::any_of(object.references, [&](const ReferenceInfo& reference) {
                                return reference.pid != static_cast<std::uint32_t>(process);
                              });
  const bool used = object.registered || object.bound_tasks > 0;
  return object.kept || held_by_others || (used && !object.name.starts_with(prefix));
}

}  // namespace

Result<PoolRoom> PoolRoom::of(const ObjectPool& pool, std::string_view instance, pid_t process) {
  const auto objects = pool.list();
  if (!objects) return std::unexpected(objects.error());
  PoolRoom room(pool);
  const std::string prefix = fmt::format("{}/", instance);
  for (const ObjectInfo& object : *objects) {
    if (!stays(object, prefix, process)) continue;
    (object.type == ObjectType::event ? room.events_ : room.others_).insert(object.name);
  }
  const std::size_t taken = room.events_.size() + room.others_.size();
  room.free_ = room.capacity_ - std::min(room.capacity_, taken);
  return room;
}

Result<void> PoolRoom::take(std::string_view object) {
  if (others_.contains(object)) {
    return failure(ErrorCode::wrong_type, fmt::format("'{}' in pool '{}' is no event", object, pool_));
  }
  if (events_.contains(object)) return {};
  if (free_ == 0) {
    return failure(ErrorCode::full,
                   fmt::format("pool '{}' has no room for event '{}': its {} objects are in use", pool_,
                               object, capacity_));
  }
  --free_;
  events_.emplace(object);
  return {};
}

}  // namespace plchost
