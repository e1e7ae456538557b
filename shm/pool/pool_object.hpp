#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "shm/base/time.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/pool/pool_event.hpp"
#include "shm/pool/pool_layout.hpp"
#include "shm/pool/pool_mutex.hpp"

namespace plchost {

class PoolSegment;

/// The result of an operation on an object. The C API has a result for each.
enum class ObjectStatus : std::uint8_t {
  done = 0,
  timed_out,
  owner_died,     ///< mutex: locked; the one before ended while it held it
  deadlock,       ///< mutex: the calling thread holds it already
  not_owner,      ///< mutex: the calling thread does not hold it
  full,           ///< semaphore: at its greatest value
  not_permitted,  ///< opened to read only
  gone,           ///< closed, or the pool was damaged and the object lost
  corrupt,        ///< a stranger has written into it, or cut the pool's file short
  bad_cursor,     ///< event: the cursor is ahead of the posts that were made
};

/// A reference on one object of the pool, released at the end of its life, or by the next user of the pool if
/// the process ends. Movable; outlives its ObjectPool. Operations: any context, from one thread at a time or
/// many; close and destruction: set-up.
class PoolObject {
 public:
  PoolObject() noexcept = default;
  PoolObject(PoolObject&& other) noexcept { swap(other); }
  PoolObject& operator=(PoolObject&& other) noexcept {
    PoolObject old;
    old.swap(*this);
    swap(other);
    return *this;
  }
  PoolObject(const PoolObject&) = delete;
  PoolObject& operator=(const PoolObject&) = delete;
  ~PoolObject() { close(); }

  void close() noexcept;
  /// False: closed, or the object was lost.
  [[nodiscard]] bool valid() const noexcept {
    return entry_ != nullptr &&
           Binding::generation(entry_->binding.load(std::memory_order_acquire)) == generation_;
  }
  [[nodiscard]] bool writable() const noexcept { return writable_; }

 protected:
  friend class ObjectPool;
  /// Counts the calling thread as one that waits for the object, for others to see.
  class Waiting {
   public:
    explicit Waiting(const PoolObject& object) noexcept;
    ~Waiting();
    Waiting(const Waiting&) = delete;
    Waiting& operator=(const Waiting&) = delete;

   private:
    ReferenceEntry* reference_;  // null: the pool is mapped to read only
  };

  [[nodiscard]] ObjectStatus usable() const noexcept {
    if (!valid()) return why_not_valid();
    return writable_ ? ObjectStatus::done : ObjectStatus::not_permitted;
  }
  [[nodiscard]] ObjectStatus why_not_valid() const noexcept;
  [[nodiscard]] ObjectEntry& entry() const noexcept { return *entry_; }
  /// The mutex of a pool across containers. Otherwise it is the entry's, without a step between: this is for
  /// cycles.
  [[nodiscard]] PoolMutex mutex() const noexcept;
  [[nodiscard]] bool across() const noexcept;
  /// A waiter can be marked in it, so that a poster wakes it.
  [[nodiscard]] bool can_be_marked() const noexcept { return reference_ != nullptr; }

 private:
  void swap(PoolObject& other) noexcept;

  std::shared_ptr<PoolSegment> segment_;
  ObjectEntry* entry_ = nullptr;
  ReferenceEntry* reference_ = nullptr;
  std::uint32_t generation_ = 0;
  std::uint32_t reference_generation_ = 0;
  bool writable_ = false;
};

/// A counted event: see CountedEvent. Each waiter has a cursor of its own, so nothing is taken from anyone.
class SharedEvent : public PoolObject {
 public:
  static constexpr ObjectType kType = ObjectType::event;

  /// One atomic add, and one wake if someone waits.
  ObjectStatus post() const noexcept {
    const ObjectStatus now = usable();
    if (now == ObjectStatus::done) entry().event.post();
    return now;
  }
  /// Posts since it was made.
  [[nodiscard]] std::uint64_t count() const noexcept;
  /// Waits until more than `cursor` posts were made, and sets it to their number: count - cursor were posted
  /// in between. Begin with count(). bad_cursor: it is of another event, or of none. The right to read is
  /// enough; through a pool that was attached to read only posts are looked for every millisecond.
  ObjectStatus wait(std::uint64_t& cursor, TimePoint deadline = kNoDeadline) const noexcept;
  /// For the runtime, which binds tasks to it.
  [[nodiscard]] PoolEvent event() const noexcept;
};

/// See CountingSemaphore: a number that any user may raise and lower; units that an ended user took stay
/// taken. For exclusive use take a mutex.
class SharedSemaphore : public PoolObject {
 public:
  static constexpr ObjectType kType = ObjectType::semaphore;

  ObjectStatus post() const noexcept;
  ObjectStatus wait(TimePoint deadline = kNoDeadline) const noexcept;
  ObjectStatus try_wait() const noexcept;
  [[nodiscard]] std::uint32_t value() const noexcept;
};

/// See PoolMutex. It belongs to the thread that locked it.
class SharedMutex : public PoolObject {
 public:
  static constexpr ObjectType kType = ObjectType::mutex;

  ObjectStatus lock(TimePoint deadline = kNoDeadline) const noexcept;
  /// timed_out: it is held.
  ObjectStatus try_lock() const noexcept;
  ObjectStatus unlock() const noexcept;
  /// The thread that holds it; 0: none.
  [[nodiscard]] std::uint32_t owner() const noexcept;
};

/// A region of memory of its own, mapped into this process as long as this exists.
class SharedMemory : public PoolObject {
 public:
  static constexpr ObjectType kType = ObjectType::memory;

  /// Written only if writable(): else the first write is a SIGSEGV.
  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return memory_.bytes(); }
  /// See MemoryFile.
  [[nodiscard]] bool guarded() const noexcept { return memory_.guarded(); }
  [[nodiscard]] bool lost() const noexcept { return memory_.lost(); }

 private:
  friend class ObjectPool;
  MemoryFile memory_;
};

}  // namespace plchost
