// The C API over the pool: see shm/plc_pool.h. No exception leaves it.

#include "shm/plc_pool.h"

#include <memory>
#include <new>
#include <string>

#include "shm/base/counting_semaphore.hpp"
#include "shm/guard/memory_guard.hpp"
#include "shm/library/pool_result.hpp"
#include "shm/pool/object_pool.hpp"

struct plc_pool {
  plchost::ObjectPool pool;
};
struct plc_event {
  plchost::SharedEvent object;
};
struct plc_semaphore {
  plchost::SharedSemaphore object;
};
struct plc_mutex {
  plchost::SharedMutex object;
};
struct plc_memory {
  plchost::SharedMemory object;
};

namespace plchost {

namespace {

static_assert(PLC_POOL_MAX_VALUE == CountingSemaphore::kMaxValue);
static_assert(PLC_POOL_MEMORY == static_cast<unsigned>(ObjectType::memory));
static_assert(PLC_POOL_SEMAPHORE == static_cast<unsigned>(ObjectType::semaphore));
static_assert(PLC_POOL_EVENT == static_cast<unsigned>(ObjectType::event));
static_assert(PLC_POOL_MUTEX == static_cast<unsigned>(ObjectType::mutex));

TimePoint deadline_of(long timeout_ns) noexcept {
  if (timeout_ns == PLC_POOL_FOREVER) return kNoDeadline;
  const TimePoint now = MonotonicClock::now();
  if (timeout_ns < 0) return now;
  return kNoDeadline - now > Duration(timeout_ns) ? now + Duration(timeout_ns) : kNoDeadline;
}

/// Nothing: the options are of another version of the header, or hold what is not allowed.
std::optional<ObjectOptions> options_of(const plc_object_options* given) {
  if (given == nullptr) return ObjectOptions{};
  constexpr unsigned kPermissions = 0666;
  if (given->size != sizeof(*given) || (given->flags & ~PLC_POOL_KEEP) != 0 ||
      (given->mode & ~kPermissions) != 0) {
    return std::nullopt;
  }
  ObjectOptions options{.keep = (given->flags & PLC_POOL_KEEP) != 0, .mode = given->mode};
  if (given->group != 0) options.group = given->group;
  return options;
}

bool is_access(int access) noexcept {
  return access == PLC_POOL_READ || access == PLC_POOL_READ_WRITE;
}

MemoryFile::Access access_of(int access) noexcept {
  return access == PLC_POOL_READ ? MemoryFile::Access::read_only : MemoryFile::Access::read_write;
}

/// Hands what `make` gives over as a new Handle.
template <class Handle, class Make>
int create(const plc_pool* pool, const char* name, const plc_object_options* given, Handle** handle,
           Make make) {
  return guarded([&]() -> int {
    if (pool == nullptr || name == nullptr || handle == nullptr) return argument("a pointer is null");
    const auto options = options_of(given);
    if (!options)
      return argument("options: size is sizeof(plc_object_options), flags PLC_POOL_KEEP, mode up to 0666");
    auto made = make(*options);
    if (!made) return failed(made.error());
    *handle = new Handle{std::move(made->object)};
    return made->made ? PLC_POOL_OK : PLC_POOL_ALREADY_THERE;
  });
}

template <class Handle, class Open>
int open(const plc_pool* pool, const char* name, int access, Handle** handle, Open open_it) {
  return guarded([&]() -> int {
    if (pool == nullptr || name == nullptr || handle == nullptr) return argument("a pointer is null");
    if (!is_access(access)) return argument("access is PLC_POOL_READ or PLC_POOL_READ_WRITE");
    auto opened = open_it(access_of(access));
    if (!opened) return failed(opened.error());
    *handle = new Handle{*std::move(opened)};
    return PLC_POOL_OK;
  });
}

int visit(const ObjectInfo& info, plc_pool_visitor visitor, void* user) {
  const plc_object_info told{.name = info.name.c_str(),
                             .type = static_cast<unsigned>(info.type),
                             .references = info.reference_count,
                             .waiters = info.waiters,
                             .kept = info.kept ? 1U : 0U,
                             .value = info.value,
                             .size = info.size};
  return visitor(&told, user);
}

}  // namespace

}  // namespace plchost

using namespace plchost;  // NOLINT(google-build-using-namespace): the functions of C are in none

int plc_pool_open(const char* name, int access, plc_pool** pool) {
  return guarded([&]() -> int {
    if (pool == nullptr) return argument("pool is null");
    MemoryGuard::watch_process();
    const std::string wanted = pool_name_of(name);
    if (access == PLC_POOL_MAKE) {
      auto made = ObjectPool::create(wanted);
      if (!made) return failed(made.error());
      *pool = new plc_pool{*std::move(made)};
      return PLC_POOL_OK;
    }
    if (!is_access(access)) return argument("access is PLC_POOL_READ, PLC_POOL_READ_WRITE or PLC_POOL_MAKE");
    auto attached = ObjectPool::attach(wanted, access_of(access));
    if (!attached) return failed(attached.error());
    *pool = new plc_pool{*std::move(attached)};
    return PLC_POOL_OK;
  });
}

void plc_pool_close(plc_pool* pool) {
  delete pool;
}

int plc_pool_remove(plc_pool* pool, const char* name) {
  return guarded([&]() -> int {
    if (pool == nullptr || name == nullptr) return argument("a pointer is null");
    const auto removed = pool->pool.remove_object(name);
    return removed ? PLC_POOL_OK : failed(removed.error());
  });
}

int plc_pool_list(plc_pool* pool, plc_pool_visitor visitor, void* user) {
  return guarded([&]() -> int {
    if (pool == nullptr || visitor == nullptr) return argument("a pointer is null");
    const auto all = pool->pool.list();
    if (!all) return failed(all.error());
    int count = 0;
    for (const ObjectInfo& info : *all) {
      ++count;
      if (visit(info, visitor, user) != 0) break;
    }
    return count;
  });
}

int plc_event_create(plc_pool* pool, const char* name, const plc_object_options* options, plc_event** event) {
  return create(pool, name, options, event,
                [&](const ObjectOptions& wanted) { return pool->pool.create_shared_event(name, wanted); });
}

int plc_event_open(plc_pool* pool, const char* name, int access, plc_event** event) {
  return open(pool, name, access, event,
              [&](MemoryFile::Access wanted) { return pool->pool.open_shared_event(name, wanted); });
}

int plc_event_post(plc_event* event) {
  return event == nullptr ? PLC_POOL_ARGUMENT : result_of(event->object.post());
}

plc_pool_u64 plc_event_count(const plc_event* event) {
  return event == nullptr ? 0 : event->object.count();
}

int plc_event_wait(plc_event* event, plc_pool_u64* cursor, long timeout_ns) {
  if (event == nullptr || cursor == nullptr) return PLC_POOL_ARGUMENT;
  std::uint64_t at = *cursor;
  const int result = result_of(event->object.wait(at, deadline_of(timeout_ns)));
  *cursor = at;
  return result;
}

void plc_event_close(plc_event* event) {
  delete event;
}

int plc_semaphore_create(plc_pool* pool, const char* name, unsigned int value,
                         const plc_object_options* options, plc_semaphore** semaphore) {
  return create(pool, name, options, semaphore, [&](const ObjectOptions& wanted) {
    return pool->pool.create_semaphore(name, value, wanted);
  });
}

int plc_semaphore_open(plc_pool* pool, const char* name, int access, plc_semaphore** semaphore) {
  return open(pool, name, access, semaphore,
              [&](MemoryFile::Access wanted) { return pool->pool.open_semaphore(name, wanted); });
}

int plc_semaphore_post(plc_semaphore* semaphore) {
  return semaphore == nullptr ? PLC_POOL_ARGUMENT : result_of(semaphore->object.post());
}

int plc_semaphore_wait(plc_semaphore* semaphore, long timeout_ns) {
  if (semaphore == nullptr) return PLC_POOL_ARGUMENT;
  const ObjectStatus at_once = semaphore->object.try_wait();
  if (at_once != ObjectStatus::timed_out) return result_of(at_once);
  return result_of(semaphore->object.wait(deadline_of(timeout_ns)));
}

unsigned int plc_semaphore_value(const plc_semaphore* semaphore) {
  return semaphore == nullptr ? 0 : semaphore->object.value();
}

void plc_semaphore_close(plc_semaphore* semaphore) {
  delete semaphore;
}

int plc_mutex_create(plc_pool* pool, const char* name, const plc_object_options* options, plc_mutex** mutex) {
  return create(pool, name, options, mutex,
                [&](const ObjectOptions& wanted) { return pool->pool.create_mutex(name, wanted); });
}

int plc_mutex_open(plc_pool* pool, const char* name, plc_mutex** mutex) {
  return open(pool, name, PLC_POOL_READ_WRITE, mutex,
              [&](MemoryFile::Access) { return pool->pool.open_mutex(name); });
}

int plc_mutex_lock(plc_mutex* mutex, long timeout_ns) {
  if (mutex == nullptr) return PLC_POOL_ARGUMENT;
  const ObjectStatus at_once = mutex->object.try_lock();
  if (at_once != ObjectStatus::timed_out) return result_of(at_once);
  return result_of(mutex->object.lock(deadline_of(timeout_ns)));
}

int plc_mutex_unlock(plc_mutex* mutex) {
  return mutex == nullptr ? PLC_POOL_ARGUMENT : result_of(mutex->object.unlock());
}

void plc_mutex_close(plc_mutex* mutex) {
  delete mutex;
}

int plc_memory_create(plc_pool* pool, const char* name, size_t size, const plc_object_options* options,
                      plc_memory** memory) {
  return create(pool, name, options, memory,
                [&](const ObjectOptions& wanted) { return pool->pool.create_memory(name, size, wanted); });
}

int plc_memory_open(plc_pool* pool, const char* name, int access, plc_memory** memory) {
  return open(pool, name, access, memory,
              [&](MemoryFile::Access wanted) { return pool->pool.open_memory(name, wanted); });
}

void* plc_memory_address(const plc_memory* memory) {
  return memory == nullptr ? nullptr : memory->object.bytes().data();
}

size_t plc_memory_size(const plc_memory* memory) {
  return memory == nullptr ? 0 : memory->object.bytes().size();
}

void plc_memory_close(plc_memory* memory) {
  delete memory;
}
