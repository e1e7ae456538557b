#include "shm/pool/pool_lock.hpp"

#include <chrono>

#include <fmt/format.h>

#include "shm/base/time.hpp"

namespace plchost {

namespace {

// Set-up under the mutex takes microseconds, a repair of the largest pool some 100 ms.
constexpr auto kPatience = std::chrono::seconds(5);

}  // namespace

// Only who holds the mutex writes `changes`; one that died has left it odd. Sequentially consistent, so that
// what follows is not seen before it.
PoolLock::PoolLock(PoolHeader& header, bool owner_died) noexcept : header_(&header), owner_died_(owner_died) {
  header.changes.fetch_or(1);
}

PoolLock::~PoolLock() {
  if (header_ == nullptr) return;
  header_->changes.fetch_add(1);
  header_->mutex.unlock();
}

Result<PoolLock> PoolLock::acquire(PoolHeader& header, const std::string& pool) {
  switch (header.mutex.lock(MonotonicClock::now() + kPatience)) {
    case LockResult::locked:
      return PoolLock(header, (header.changes.load(std::memory_order_relaxed) & 1) != 0);
    case LockResult::owner_died:
      return PoolLock(header, true);
    case LockResult::timed_out:
      return failure(ErrorCode::timed_out,
                     fmt::format("pool '{}': thread {} holds its mutex for more than {} s", pool,
                                 header.mutex.owner(), kPatience.count()));
    case LockResult::deadlock:
    case LockResult::corrupt:
      break;
  }
  return failure(ErrorCode::corrupt,
                 fmt::format("pool '{}': its mutex is damaged; stop who uses the pool and remove it", pool));
}

}  // namespace plchost
