#include "shm/library/obj_tab.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <type_traits>
#include <utility>

#include <pthread.h>
#include <unistd.h>

#include "shm/library/pool_result.hpp"

namespace plchost {

namespace {

std::mutex making;  // of the one table of the process

// How often this thread holds the guard: std::recursive_timed_mutex does not tell.
thread_local unsigned held_by_this_thread = 0;

/// A type of objects that the seed's table shows.
struct ShownType {
  ObjectType type;
  objTabType_t as;
  /// For semTake and semGive; null: the object cannot be opened. Null of a memory, which has an address.
  std::unique_ptr<plc_sem> (*open)(const ObjectPool& pool, const std::string& name);
};

template <class Object>
std::unique_ptr<plc_sem> open_handle(const ObjectPool& pool, const std::string& name) {
  auto opened = pool.open_object<Object>(name);
  if (!opened) return nullptr;
  auto handle = std::make_unique<plc_sem>();
  if constexpr (std::is_same_v<Object, SharedEvent>) handle->cursor = opened->count();
  handle->object = *std::move(opened);
  return handle;
}

constexpr std::array kShownTypes{
    ShownType{.type = SharedMemory::kType, .as = e_shm, .open = nullptr},
    ShownType{.type = SharedSemaphore::kType, .as = e_sem, .open = open_handle<SharedSemaphore>},
    ShownType{.type = SharedMutex::kType, .as = e_sem, .open = open_handle<SharedMutex>},
    ShownType{.type = SharedEvent::kType, .as = e_evt, .open = open_handle<SharedEvent>}};

/// Null: a type that the seed's table does not have, nor anything like it.
const ShownType* find_shown(ObjectType type) noexcept {
  const auto* const found = std::ranges::find(kShownTypes, type, &ShownType::type);
  return found == kShownTypes.end() ? nullptr : found;
}

SharedMemory open_memory(const ObjectPool& pool, const std::string& name) {
  if (auto writable = pool.open_memory(name)) return *std::move(writable);
  if (auto readable = pool.open_memory(name, MemoryFile::Access::read_only)) return *std::move(readable);
  return {};
}

// Nobody but this table needs it any more.
bool is_left_over(const ObjectInfo& info) noexcept {
  return !info.kept && info.reference_count <= 1 && info.bound_tasks == 0;
}

std::optional<TimePoint> deadline_of(int ticks) noexcept {
  if (ticks < 0) return std::nullopt;
  return MonotonicClock::now() + std::chrono::milliseconds(ticks);
}

STATUS status_of(bool done) noexcept {
  return done ? OK : ERROR;
}

STATUS take_guard(std::recursive_timed_mutex& guard, std::optional<TimePoint> deadline) {
  if (deadline) {
    if (!guard.try_lock_for(*deadline - MonotonicClock::now())) return ERROR;
  } else {
    guard.lock();
  }
  ++held_by_this_thread;
  return OK;
}

STATUS take(plc_sem& semaphore, std::optional<TimePoint> deadline) {
  const TimePoint until = deadline.value_or(kNoDeadline);
  if (auto* const guard = std::get_if<std::recursive_timed_mutex*>(&semaphore.object)) {
    return take_guard(**guard, deadline);
  }
  if (const auto* const counting = std::get_if<SharedSemaphore>(&semaphore.object)) {
    return status_of(counting->wait(until) == ObjectStatus::done);
  }
  if (const auto* const mutex = std::get_if<SharedMutex>(&semaphore.object)) {
    const ObjectStatus locked = mutex->lock(until);
    return status_of(locked == ObjectStatus::done || locked == ObjectStatus::owner_died);
  }
  // One post for each call, as a semaphore would: wait() sets the cursor to all of them.
  const auto& event = std::get<SharedEvent>(semaphore.object);
  const std::atomic_ref cursor(semaphore.cursor);
  for (;;) {
    std::uint64_t taken = cursor.load();
    std::uint64_t posted = taken;
    if (event.wait(posted, until) != ObjectStatus::done) return ERROR;
    if (cursor.compare_exchange_strong(taken, taken + 1)) return OK;
  }
}

STATUS give(plc_sem& semaphore) {
  if (auto* const guard = std::get_if<std::recursive_timed_mutex*>(&semaphore.object)) {
    if (held_by_this_thread == 0) return ERROR;
    --held_by_this_thread;
    (*guard)->unlock();
    return OK;
  }
  if (const auto* const counting = std::get_if<SharedSemaphore>(&semaphore.object)) {
    return status_of(counting->post() == ObjectStatus::done);
  }
  if (const auto* const mutex = std::get_if<SharedMutex>(&semaphore.object)) {
    return status_of(mutex->unlock() == ObjectStatus::done);
  }
  return status_of(std::get<SharedEvent>(semaphore.object).post() == ObjectStatus::done);
}

}  // namespace

// A child of fork() has the parent's table, whose pool it cannot use and whose guard another thread may have
// held: it makes its own. The parent's stays for good: the child may still be on its entries.
Result<ObjTab*> ObjTab::of_this_process() {
  static ObjTab* table = nullptr;
  static pid_t owner = 0;
  static const int survives_fork =
      ::pthread_atfork([] { making.lock(); }, [] { making.unlock(); }, [] { making.unlock(); });
  if (survives_fork != 0) return failure(ErrorCode::system, "cannot watch for forks", survives_fork);
  const std::lock_guard one_at_a_time(making);
  if (table == nullptr || owner != ::getpid()) {
    PLCHOST_TRY_ASSIGN(auto pool, ObjectPool::attach(pool_name_of(nullptr)));
    table = new ObjTab(std::move(pool));
    owner = ::getpid();
    held_by_this_thread = 0;
  }
  return table;
}

// The entries stay where they are for good: walkers of other threads may be on them.
ObjTab::ObjTab(ObjectPool pool) : pool_(std::move(pool)), guard_handle_{.object = &guard_} {
  entries_.reserve(pool_.capacity());
  table_ = {.ulVersion = OBJTAB_VERSION,
            .hSem = &guard_handle_,
            .ptEntries = entries_.data(),
            .ulSize = 0,
            .ulRefCnt = 1};
}

Result<objTab_t*> ObjTab::look() {
  const std::lock_guard one_at_a_time(guard_);
  if (held_by_this_thread == 0 && (!listed_ || pool_.changes() != seen_)) {
    PLCHOST_TRY(refresh());
  }
  return &table_;
}

// Where it fails, the table is as it was; only one that was never listed has nothing to show.
Result<void> ObjTab::refresh() {
  const auto all = pool_.list();
  if (!all && listed_) return {};
  PLCHOST_TRY(all);
  std::map<std::pair<std::string, ObjectType>, std::unique_ptr<Row>> before;
  for (auto& row : rows_) before[{row->name, row->type}] = std::move(row);
  rows_.clear();
  for (const ObjectInfo& info : *all) {
    const ShownType* const shown = find_shown(info.type);
    if (shown == nullptr) continue;
    const auto known = before.find({info.name, info.type});
    if (known == before.end()) {
      auto row = std::make_unique<Row>(Row{.name = info.name, .type = info.type, .as = shown->as});
      if (shown->open != nullptr) row->semaphore = shown->open(pool_, info.name);
      if (shown->as == e_shm) row->memory = open_memory(pool_, info.name);
      rows_.push_back(std::move(row));
    } else if (!is_left_over(info)) {
      rows_.push_back(std::move(known->second));
    }
  }
  before.clear();
  std::ranges::sort(rows_, {}, [](const std::unique_ptr<Row>& row) { return std::string_view(row->name); });
  entries_.clear();
  for (const auto& row : rows_) {
    if (entries_.size() < entries_.capacity()) entries_.push_back(entry_of(*row));
  }
  table_.ulSize = entries_.size();
  seen_ = pool_.changes();
  listed_ = true;
  return {};
}

objEntry_t ObjTab::entry_of(Row& row) noexcept {
  objEntry_t entry{.tType = row.as, .pszName = row.name.data(), .u = {}};
  switch (row.as) {
    case e_shm:
      entry.u.tShmEntry = {.ulAddress = reinterpret_cast<unsigned long>(row.memory.bytes().data()),
                           .ulSize = row.memory.bytes().size()};
      break;
    case e_sem:
      entry.u.tSemEntry = {.hSem = row.semaphore.get()};
      break;
    case e_evt:
      entry.u.tEvtEntry = {.hEvt = row.semaphore.get()};
      break;
  }
  return entry;
}

}  // namespace plchost

objTab_t* plc_obj_tab() {
  objTab_t* found = nullptr;
  (void)plchost::guarded([&] {
    const auto table = plchost::ObjTab::of_this_process();
    if (!table) return plchost::failed(table.error());
    const auto looked = (*table)->look();
    if (!looked) return plchost::failed(looked.error());
    found = *looked;
    return 0;
  });
  return found;
}

STATUS semTake(SEM_ID semId, int timeout) {
  return semId == nullptr ? ERROR : plchost::take(*semId, plchost::deadline_of(timeout));
}

STATUS semGive(SEM_ID semId) {
  return semId == nullptr ? ERROR : plchost::give(*semId);
}
