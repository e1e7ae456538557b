#include "shm/pool/pool_lock.hpp"

#include <fstream>

#include <fmt/format.h>

#include "shm/files/memory_file.hpp"
#include "shm/process/thread_owner.hpp"

namespace plchost {

namespace {

std::string describe_thread(std::uint32_t thread) {
  const auto owner = owner_of_thread(thread);
  if (!owner) return fmt::format("thread {}", thread);
  return fmt::format("process {} ({})", owner->pid, owner->program);
}

// The holder of the lock has the pool mapped. Where that cannot be seen it is taken for granted.
bool has_mapped(std::uint32_t thread, const std::string& pool) {
  std::ifstream mappings(fmt::format("/proc/{}/maps", thread));
  if (!mappings) return true;
  const std::string path = MemoryFile::path(pool);
  for (std::string line; std::getline(mappings, line);) {
    if (line.ends_with(path) || line.ends_with(path + " (deleted)")) return true;
  }
  return mappings.bad();
}

}  // namespace

// Only the thread that holds the mutex writes `changes`; one that ended has left it odd. Sequentially
// consistent, so that no later store is seen before it.
PoolLock::PoolLock(PoolMutex mutex, PoolHeader& header, PoolJournal& journal, bool owner_died) noexcept
    : mutex_(mutex), header_(&header), journal_(&journal), owner_died_(owner_died) {
  header.changes.fetch_or(1);
}

PoolLock::~PoolLock() {
  if (header_ == nullptr) return;
  journal_->commit();
  header_->changes.fetch_add(1);
  mutex_.unlock();
}

Result<PoolLock> PoolLock::acquire(PoolMutex mutex, PoolHeader& header, PoolJournal& journal,
                                   const PoolClients& clients, const std::string& pool, Duration patience) {
  switch (mutex.lock(MonotonicClock::now() + patience)) {
    case LockResult::locked:
      return PoolLock(mutex, header, journal, (header.changes.load(std::memory_order_relaxed) & 1) != 0);
    case LockResult::owner_died:
      return PoolLock(mutex, header, journal, true);
    case LockResult::timed_out: {
      const std::uint32_t holder = mutex.holder();
      const bool by_thread = !clients.across_containers();
      if (by_thread && holder != 0 && !has_mapped(holder, pool) && header.mutex.take_from(holder)) {
        return PoolLock(mutex, header, journal, true);
      }
      return failure(ErrorCode::timed_out,
                     fmt::format("pool '{}': {} holds its lock for more than {} ms; is it stopped?", pool,
                                 by_thread ? describe_thread(holder) : clients.describe(holder),
                                 patience / std::chrono::milliseconds(1)));
    }
    case LockResult::deadlock:
    case LockResult::corrupt:
      break;
  }
  return failure(
      ErrorCode::corrupt,
      fmt::format("pool '{}': its mutex is damaged; stop all processes that use the pool, and remove it",
                  pool));
}

}  // namespace plchost
