#include "shm/pool/pool_mutex.hpp"

#include "shm/pool/process_pools.hpp"
#include "shm/threads/process_start.hpp"

namespace plchost {

namespace {

/// How many mutexes of pools across containers the thread holds. The processes that wait for them cannot see
/// its end.
thread_local std::uint32_t held_by_thread = 0;

void note(LockResult result) noexcept {
  if (result != LockResult::locked && result != LockResult::owner_died) return;
  if (++held_by_thread == 1) ProcessPools::of_this_process().watch_thread(held_by_thread);
}

}  // namespace

void PoolMutex::forget_held() noexcept {
  held_by_thread = 0;
}

ClientThread PoolMutex::self() const noexcept {
  return {.client = locks_->number(*numbers_), .thread = this_thread().id};
}

LockResult PoolMutex::lock_across(TimePoint deadline) noexcept {
  const ClientThread caller = self();
  if (caller.client == 0) return LockResult::corrupt;
  const LockResult result = across(*place_).lock(caller, *locks_, deadline);
  note(result);
  return result;
}

LockResult PoolMutex::try_lock_across() noexcept {
  const ClientThread caller = self();
  if (caller.client == 0) return LockResult::corrupt;
  const LockResult result = across(*place_).try_lock(caller);
  note(result);
  return result;
}

bool PoolMutex::unlock_across() noexcept {
  const bool done = across(*place_).unlock(self());
  if (done && held_by_thread > 0) --held_by_thread;
  return done;
}

}  // namespace plchost
