#include "shm/pool/pool_room.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>

#include <fmt/format.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "shm/base/names.hpp"
#include "shm/files/memory_file.hpp"

namespace plchost {

namespace {

/// The processes that hold references, and go on.
class Holders {
 public:
  Holders(const ObjectPool& pool, pid_t that_ends) noexcept
      : pool_(pool), that_ends_(static_cast<std::uint32_t>(that_ends)) {}
  /// One whose references nobody has released yet may have ended.
  [[nodiscard]] bool goes_on(const ReferenceInfo& reference) {
    if (reference.pid != 0 && reference.pid == that_ends_) return false;
    const auto [known, is_new] =
        goes_on_.try_emplace(std::tuple(reference.pid, reference.start, reference.image), false);
    if (is_new) known->second = !pool_.has_ended(reference);
    return known->second;
  }

 private:
  const ObjectPool& pool_;
  std::uint32_t that_ends_;
  // By pid, start and image: a dead process and a running one may have the same pid.
  std::map<std::tuple<std::uint32_t, std::uint64_t, std::uint32_t>, bool> goes_on_;
};

// The references of the process that ends go with it, and so do registrations and tasks of its own events.
bool stays(const ObjectInfo& object, std::string_view prefix, Holders& holders) {
  const bool held_by_others = object.reference_count > object.references.size() ||
                              std::ranges::any_of(object.references, [&](const ReferenceInfo& reference) {
                                return holders.goes_on(reference);
                              });
  const bool used = object.registered || object.bound_tasks > 0;
  return object.kept || held_by_others || (used && !object.name.starts_with(prefix));
}

// A shared memory has whole pages.
std::uint64_t in_pages(std::uint64_t bytes) noexcept {
  const auto page = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  return (bytes + page - 1) / page * page;
}

// Without overflow: "no limit" is the maximum.
std::uint64_t sum_of(std::uint64_t one, std::uint64_t other) noexcept {
  return one > std::numeric_limits<std::uint64_t>::max() - other ? std::numeric_limits<std::uint64_t>::max()
                                                                 : one + other;
}

}  // namespace

std::uint64_t free_shared_memory() noexcept {
  struct statvfs room{};
  // A file system without a limit says that it has no blocks at all.
  if (::statvfs(MemoryFile::kDirectory, &room) != 0 || room.f_blocks == 0) {
    return std::numeric_limits<std::uint64_t>::max();
  }
  return static_cast<std::uint64_t>(room.f_bavail) * room.f_frsize;
}

Result<PoolRoom> PoolRoom::of(const ObjectPool& pool, std::string_view instance, pid_t process,
                              std::uint64_t free_bytes) {
  PLCHOST_TRY_ASSIGN(const auto objects, pool.list());
  PoolRoom room(pool, free_bytes);
  const std::string prefix = fmt::format("{}/", instance);
  Holders holders(pool, process);
  for (const ObjectInfo& object : objects) {
    if (!stays(object, prefix, holders)) {
      if (object.type == ObjectType::memory) {
        room.free_bytes_ = sum_of(room.free_bytes_, in_pages(object.size));
      }
      continue;
    }
    (object.type == ObjectType::event ? room.events_ : room.others_).insert(object.name);
  }
  const std::size_t taken = room.events_.size() + room.others_.size();
  room.free_ = room.capacity_ - std::min(room.capacity_, taken);
  return room;
}

Result<void> PoolRoom::take_place(std::string_view kind, std::string_view object) {
  if (free_ == 0) {
    return failure(ErrorCode::full,
                   fmt::format("pool '{}' has no room for {} '{}': its {} objects are in use", pool_, kind,
                               object, capacity_));
  }
  --free_;
  return {};
}

Result<void> PoolRoom::take(std::string_view object) {
  if (others_.contains(object) || made_.contains(object)) {
    return failure(ErrorCode::wrong_type, fmt::format("'{}' in pool '{}' is no event", object, pool_));
  }
  if (events_.contains(object)) return {};
  if (auto placed = take_place("event", object); !placed) return placed;
  events_.emplace(object);
  return {};
}

Result<void> PoolRoom::take_memory(std::string_view object, std::uint64_t bytes) {
  if (!made_.emplace(object).second) return {};
  if (!others_.contains(object)) {
    if (auto placed = take_place("memory", object); !placed) return placed;
  }
  const std::uint64_t needed = in_pages(bytes);
  if (needed > free_bytes_) {
    return failure(ErrorCode::full,
                   fmt::format("{} bytes of shared memory for '{}': {} has room for {}; free some there, "
                               "enlarge it or ask for less",
                               bytes, object, MemoryFile::kDirectory, free_bytes_));
  }
  if (free_bytes_ != std::numeric_limits<std::uint64_t>::max()) free_bytes_ -= needed;
  return {};
}

}  // namespace plchost
