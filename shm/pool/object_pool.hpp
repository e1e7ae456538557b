#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/counted_event.hpp"
#include "shm/base/names.hpp"
#include "shm/base/result.hpp"
#include "shm/pool/memory_file.hpp"

namespace plchost {

struct ObjectEntry;
class PoolLock;
class PoolTable;

inline constexpr std::uint32_t kMinObjects = 16;
inline constexpr std::uint32_t kMaxObjects = 1'000'000;

/// The seed's objTabType_t, with the same numbers plus one for a free entry.
enum class ObjectType : std::uint32_t { memory = 0, semaphore = 1, event = 2, free = 3 };
[[nodiscard]] std::string_view to_string(ObjectType type) noexcept;

/// What a post did.
enum class PostResult : std::uint8_t {
  posted,          ///< every task that is bound to the event will run for it
  no_task,         ///< counted, but no task is bound at this time: a soft result
  not_registered,  ///< nothing was counted: the event is not (or no longer) registered
};

/// A handle on one external event of the pool. Cheap to copy; valid while the ObjectPool that gave it lives.
class PoolEvent {
 public:
  PoolEvent() noexcept = default;

  /// Any context, real-time included: one atomic add, and one wake if someone waits.
  PostResult post() const noexcept;

  /// Whether it may be posted to. A task may be bound to an event that is not registered yet.
  [[nodiscard]] bool registered() const noexcept;
  /// False, and nothing is done, if the handle is not valid (any more).
  bool set_registered(bool registered) const noexcept;

  /// How many tasks wait for it: kept by their instance, so that a poster can be told.
  [[nodiscard]] std::uint32_t bound_tasks() const noexcept;
  /// False, and nothing is done, if the handle is not valid (any more).
  bool set_bound_tasks(std::uint32_t count) const noexcept;

  /// The counter itself, for the task that waits on it. Only of a valid handle.
  [[nodiscard]] CountedEvent& counted() const noexcept;

  /// False if the handle is empty, or the object behind it was removed and its place given to another.
  [[nodiscard]] bool valid() const noexcept;

 private:
  friend class ObjectPool;
  explicit PoolEvent(ObjectEntry& entry) noexcept;
  bool change_binding(std::uint64_t clear, std::uint64_t set) const noexcept;

  ObjectEntry* entry_ = nullptr;
  std::uint32_t generation_ = 0;
};

/// One object as list() shows it.
struct ObjectInfo {
  std::string name;
  ObjectType type = ObjectType::free;
  std::uint64_t value = 0;        ///< event: posts so far
  bool registered = false;        ///< event
  std::uint32_t bound_tasks = 0;  ///< event
};

struct PoolOptions {
  /// kMinObjects to kMaxObjects. What counts is the number that the pool was made with.
  std::uint32_t max_objects = 4096;
};

/// The global table of named objects in shared memory (vxworks_specific, "Global object pools"). Made by the
/// manager, or by the first instance that runs alone; found by name; survives every process that uses it.
/// All functions here are set-up: they take the pool's robust, priority-inheriting mutex, and repair the
/// index if its owner died. Posting and waiting never do.
class ObjectPool {
 public:
  /// Makes the pool, or opens it when it is there already; several processes may do so at once. `name` is its
  /// name below /dev/shm.
  /// corrupt: there is something of that name that is not a pool of this version.
  [[nodiscard]] static Result<ObjectPool> create(const std::string& name, const PoolOptions& options = {});
  /// not_found: no pool of that name. Waits a moment for one that is just being made.
  [[nodiscard]] static Result<ObjectPool> attach(const std::string& name);
  static void remove(const std::string& name) noexcept { MemoryFile::remove(name); }

  ObjectPool(ObjectPool&&) noexcept = default;
  ObjectPool& operator=(ObjectPool&&) noexcept = default;

  /// The event of that name (1 to kMaxObjectName printable characters), made if it is not there, then neither
  /// registered nor bound. When the table is full, it takes the place of one that is neither; full: there is
  /// none. already_exists: the name is taken by an object of another type.
  [[nodiscard]] Result<PoolEvent> create_event(std::string_view name);
  /// not_found: no such object. already_exists: it is of another type.
  [[nodiscard]] Result<PoolEvent> open_event(std::string_view name) const;

  /// All objects that are in use: events that are registered or bound. Unordered.
  /// Nothing if the pool cannot be locked.
  [[nodiscard]] std::vector<ObjectInfo> list() const;

  [[nodiscard]] const std::string& name() const noexcept { return name_; }

 private:
  ObjectPool(std::string name, MemoryFile memory, std::uint32_t max_objects) noexcept
      : name_(std::move(name)), memory_(std::move(memory)), max_objects_(max_objects) {}
  static Result<ObjectPool> attach_now(const std::string& name);
  static Result<ObjectPool> attach_patiently(const std::string& name);
  [[nodiscard]] PoolTable table() const noexcept;
  [[nodiscard]] Result<PoolLock> lock(PoolTable& table) const;

  std::string name_;
  MemoryFile memory_;
  std::uint32_t max_objects_;  // as validated at attach: a stranger may change the pool's own
};

}  // namespace plchost
