#include "shm/pool/pool_mutex.hpp"

#include "shm/base/process_start.hpp"
#include "shm/pool/process_pools.hpp"

namespace plchost {

namespace {

/// How many mutexes of pools across containers the thread holds. The processes that wait for them cannot see
/// its end.
class HeldMutexes {
 public:
  HeldMutexes() noexcept = default;
  ~HeldMutexes() {
    if (count_ > 0) ProcessPools::of_this_process().abandon_mutexes();
  }
  HeldMutexes(const HeldMutexes&) = delete;
  HeldMutexes& operator=(const HeldMutexes&) = delete;

  void add(LockResult result) noexcept {
    if (result == LockResult::locked || result == LockResult::owner_died) ++count_;
  }
  void remove() noexcept {
    if (count_ > 0) --count_;
  }
  void forget() noexcept { count_ = 0; }

 private:
  std::uint32_t count_ = 0;
};

thread_local HeldMutexes held;

}  // namespace

void PoolMutex::forget_held() noexcept {
  held.forget();
}

ClientThread PoolMutex::self() const noexcept {
  return {.client = locks_->number(*numbers_), .thread = this_thread().id};
}

LockResult PoolMutex::lock_across(TimePoint deadline) noexcept {
  const ClientThread caller = self();
  if (caller.client == 0) return LockResult::corrupt;
  const LockResult result = across(*place_).lock(caller, *locks_, deadline);
  held.add(result);
  return result;
}

LockResult PoolMutex::try_lock_across() noexcept {
  const ClientThread caller = self();
  if (caller.client == 0) return LockResult::corrupt;
  const LockResult result = across(*place_).try_lock(caller);
  held.add(result);
  return result;
}

bool PoolMutex::unlock_across() noexcept {
  const bool done = across(*place_).unlock(self());
  if (done) held.remove();
  return done;
}

}  // namespace plchost
