#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/names.hpp"
#include "shm/base/result.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/pool/object_info.hpp"
#include "shm/pool/pool_event.hpp"
#include "shm/pool/pool_layout.hpp"
#include "shm/pool/pool_object.hpp"

namespace plchost {

class PoolAdoption;

inline constexpr std::uint32_t kMinObjects = 16;
inline constexpr std::uint32_t kMaxObjects = 1'000'000;

/// Of a pool that is made. One that is there already keeps its own.
struct PoolOptions {
  /// kMinObjects to kMaxObjects. The number that the pool was made with counts.
  std::uint32_t max_objects = 4096;
  /// The rights to it. Those that it was made with count.
  MemoryRights rights = {};
  /// Its users may be in several PID namespaces, as those of containers are. Then its mutexes do not inherit
  /// priority. The way that it was made counts.
  bool across_containers = false;
};

/// For an object that is made.
struct ObjectOptions {
  /// It stays without a reference, also across the ends of all processes, until it is removed.
  bool keep = false;
  /// The rights to it: nothing means the caller and the pool's group (if the caller is not in that, its own).
  /// Another group than one of the caller's is refused, as with files. Permission bits as those of a file, 0
  /// are the pool's. Of a memory the kernel watches over them; of the others, which lie in the pool itself,
  /// this library does, for all programs with the right to write the pool.
  std::optional<gid_t> group = std::nullopt;
  mode_t mode = 0;
};

/// The result of create: an object, and whether it was made or was there already (with its own options then).
template <class T>
struct Created {
  T object;
  bool made = false;
};

class PoolLock;

/// The changes of a pool since tidy() was called last.
struct PoolFindings {
  bool lost = false;  ///< its file was cut short by a stranger, and this process goes on with private memory
  std::uint32_t headers_mended = 0;  ///< so often had a stranger written over its header
  std::uint32_t rebuilds = 0;        ///< so often were lists found damaged, and made anew
  std::uint32_t lost_objects = 0;    ///< so many objects were not valid any more then
};

/// The global table of named objects in shared memory (vxworks_specific, "Global object pools"). Made by the
/// manager, or by the first instance that runs alone; found by name; survives every process that uses it.
///
/// All functions here are set-up: they take the pool's robust, priority-inheriting mutex, repair the pool if
/// its owner ended, and release what clients held that have ended. Operations on what they give never do. A
/// child of fork() attaches anew.
class ObjectPool {
 public:
  using Access = MemoryFile::Access;

  /// Makes the pool, or opens it when it is there already; several processes may do so at once. `name` is its
  /// name below /dev/shm. refused: its rights do not allow it.
  /// corrupt: there is something of that name that is not a pool of this version.
  [[nodiscard]] static Result<ObjectPool> create(const std::string& name, const PoolOptions& options = {});
  /// not_found: no pool of that name. Waits a moment for one that is just being made. To read only is to
  /// list, to see events and semaphores, and to map memories that allow it.
  [[nodiscard]] static Result<ObjectPool> attach(const std::string& name, Access access = Access::read_write);
  static void remove(const std::string& name) noexcept;

  /// The event of that name, made if it is not there, then neither registered nor bound. When the table is
  /// full, it takes the place of one that is neither; full: there is none. wrong_type: the name is taken.
  [[nodiscard]] Result<PoolEvent> create_event(std::string_view name) &;
  /// not_found: no such object. wrong_type: it is not an event.
  [[nodiscard]] Result<PoolEvent> open_event(std::string_view name) const&;
  /// The number of the place that the event has in the pool. Only of a valid handle of this pool.
  [[nodiscard]] std::uint32_t place_of(const PoolEvent& event) const noexcept;
  /// The event in that place, whichever it is by now; null: the pool has no such place.
  [[nodiscard]] CountedEvent* event_at(std::uint32_t place) const noexcept;
  // Of a pool that ends before the handle does.
  Result<PoolEvent> create_event(std::string_view name) && = delete;
  Result<PoolEvent> open_event(std::string_view name) const&& = delete;

  /// The object of that name, made if it is not there. It goes with its last reference, unless it is kept.
  /// `initial`: see ObjectTraits. full: no room. wrong_type, wrong_size: the present object is another one.
  /// refused: its rights do not allow it.
  template <class T>
  [[nodiscard]] Result<Created<T>> create_object(std::string_view name, std::uint64_t initial = 0,
                                                 const ObjectOptions& options = {}) {
    Created<T> created;
    PLCHOST_TRY_ASSIGN(created.made, create_into(created.object, T::kType, name, initial, options));
    return created;
  }
  /// not_found: no such object; and as above.
  template <class T>
  [[nodiscard]] Result<T> open_object(std::string_view name, Access access = Access::read_write) const {
    T object;
    PLCHOST_TRY(open_into(object, T::kType, name, access));
    return object;
  }

  // The same of one type.
  [[nodiscard]] auto create_shared_event(std::string_view name, const ObjectOptions& options = {}) {
    return create_object<SharedEvent>(name, 0, options);
  }
  [[nodiscard]] auto create_semaphore(std::string_view name, std::uint32_t value,
                                      const ObjectOptions& options = {}) {
    return create_object<SharedSemaphore>(name, value, options);
  }
  [[nodiscard]] auto create_mutex(std::string_view name, const ObjectOptions& options = {}) {
    return create_object<SharedMutex>(name, 0, options);
  }
  /// `size` in bytes, from 1 to what the host has room for. When made it has `contents`, with zeros behind
  /// them: no process sees the memory without them, whatever ends this process.
  [[nodiscard]] Result<Created<SharedMemory>> create_memory(std::string_view name, std::size_t size,
                                                            const ObjectOptions& options = {},
                                                            std::span<const std::byte> contents = {});
  [[nodiscard]] auto open_shared_event(std::string_view name, Access access = Access::read_write) const {
    return open_object<SharedEvent>(name, access);
  }
  [[nodiscard]] auto open_semaphore(std::string_view name, Access access = Access::read_write) const {
    return open_object<SharedSemaphore>(name, access);
  }
  [[nodiscard]] auto open_mutex(std::string_view name) const { return open_object<SharedMutex>(name); }
  [[nodiscard]] auto open_memory(std::string_view name, Access access = Access::read_write) const {
    return open_object<SharedMemory>(name, access);
  }

  /// A kept memory that `fill` has written, in the place of an old one of the name, which is gone for
  /// processes that have it open (and stays mapped). It has the name only when it is whole. wrong_type,
  /// refused, full.
  [[nodiscard]] Result<SharedMemory> replace_memory(std::string_view name, std::size_t size,
                                                    const MemoryFile::Fill& fill);
  /// The same in two steps: until the second one nothing has changed. The bytes keep their addresses.
  [[nodiscard]] Result<UnnamedMemory> prepare_memory(std::string_view name, std::size_t size,
                                                     const ObjectOptions& options = {}) const;
  /// After an error the memory that was prepared stays mapped.
  [[nodiscard]] Result<SharedMemory> replace_memory(std::string_view name, UnnamedMemory& prepared);

  /// Keeps the object no longer: it goes now, or with its last reference. not_found, refused.
  [[nodiscard]] Result<void> remove_object(std::string_view name);

  /// Of an instance whose process is gone: its events are registered no more, and no task takes posts to
  /// them. Else posters would be told that a task runs what nobody runs. Takes no lock. Any context.
  void withdraw_events(std::string_view instance) const noexcept;

  /// All objects that are in use: referenced, kept, registered or bound. Unordered.
  /// timed_out, corrupt: the pool cannot be locked.
  [[nodiscard]] Result<std::vector<ObjectInfo>> list() const;
  /// One of them. not_found.
  [[nodiscard]] Result<ObjectInfo> look_at(std::string_view name) const;

  /// Releases the references of ended clients, mends the damage of strangers, and makes objects of the
  /// memories that firmware has made with a header alone (see PoolAdoption). It does so without waiting for
  /// the next call of any client. Ends after some 20 ms if there is much to release, or another one holds the
  /// lock: the rest is for the next time. For the process that watches over the host, from one thread.
  PoolFindings tidy() noexcept;

  [[nodiscard]] const std::string& name() const noexcept;
  /// See PoolOptions.
  [[nodiscard]] bool across_containers() const noexcept;
  /// The process that holds an object, by what a list says of it, has ended since. Set-up.
  [[nodiscard]] bool has_ended(const ReferenceInfo& holder) const noexcept;
  /// How many objects it can hold.
  [[nodiscard]] std::uint32_t capacity() const noexcept;
  /// Another number after each call that may have changed something, of any process. Any context.
  [[nodiscard]] std::uint64_t changes() const noexcept;

 private:
  struct Wanted;
  explicit ObjectPool(std::shared_ptr<PoolSegment> segment) noexcept : segment_(std::move(segment)) {}
  // Into an empty object of that type; true: it was made.
  [[nodiscard]] Result<bool> create_into(PoolObject& object, ObjectType type, std::string_view name,
                                         std::uint64_t initial, const ObjectOptions& options);
  [[nodiscard]] Result<bool> create_into(PoolObject& object, const Wanted& wanted,
                                         const ObjectOptions& options,
                                         std::span<const std::byte> contents = {});
  [[nodiscard]] Result<bool> create_memory_into(SharedMemory& object, const Wanted& wanted,
                                                const ObjectOptions& options,
                                                std::span<const std::byte> contents);
  [[nodiscard]] Result<bool> create_locked(PoolObject& object, const Wanted& wanted,
                                           const ObjectOptions& options, UnnamedMemory* memory);
  [[nodiscard]] Result<void> open_into(PoolObject& object, ObjectType type, std::string_view name,
                                       Access access) const;
  [[nodiscard]] Result<void> open_into(PoolObject& object, const Wanted& wanted, Access access) const;
  [[nodiscard]] Result<void> open_once(PoolObject& object, const Wanted& wanted, Access access) const;
  [[nodiscard]] Result<void> find_and_refer(PoolObject& object, const Wanted& wanted, Access access) const;
  [[nodiscard]] Result<void> refer(PoolObject& object, PoolLock* held, ObjectEntry& entry,
                                   const Wanted& wanted, Access access) const;
  [[nodiscard]] Result<ObjectEntry*> make_entry(PoolLock& held, const Wanted& wanted,
                                                const ObjectOptions& options, UnnamedMemory* memory);
  [[nodiscard]] Result<void> map(SharedMemory& memory, const Wanted& wanted, Access access) const;
  [[nodiscard]] std::unexpected<Error> no_room(const Wanted& wanted) const;
  template <class Look>
  auto look_only(TimePoint until, Look look) const;
  template <class Look, class Take>
  [[nodiscard]] Result<void> look_in_parts(Look look, Take take) const;

  std::shared_ptr<PoolSegment> segment_;
  std::shared_ptr<PoolAdoption> adoption_;  // made by tidy()
};

}  // namespace plchost
