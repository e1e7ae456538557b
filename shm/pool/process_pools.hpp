#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include <pthread.h>

#include "shm/pool/client_locks.hpp"
#include "shm/pool/pool_view.hpp"

namespace plchost {

/// The pools across containers that this process uses, and their files of locks. One for each copy of this
/// library in a process. It is never destroyed: threads end after the static objects of a program do.
class ProcessPools {
 public:
  [[nodiscard]] static ProcessPools& of_this_process();

  /// Taken over fork(): a child has no number, and finds the mutex free. Not across calls of others.
  [[nodiscard]] std::unique_lock<std::mutex> lock() { return std::unique_lock(mutex_); }

  // With the lock held.

  /// Null: that file is not open yet.
  [[nodiscard]] std::shared_ptr<ClientLocks> find(std::uint64_t device, std::uint64_t file) const;
  /// Files that have no name any more and no user in this process are closed.
  void keep(std::shared_ptr<ClientLocks> locks);

  // Take the lock.

  void add(const PoolView& pool, ClientLocks& locks);
  void remove(const PoolView& pool);
  /// Any context: from now on the end of the calling thread is seen. `held`: of that thread, so many mutexes
  /// it holds.
  void watch_thread(std::uint32_t& held) noexcept { (void)::pthread_setspecific(thread_end_, &held); }
  /// The calling thread ends: mutexes that it holds in these pools are abandoned. Looks at all objects.
  void abandon_mutexes() noexcept;

 private:
  struct Used {
    PoolView view;
    ClientLocks* locks;
  };
  ProcessPools();
  pthread_key_t thread_end_{};  ///< one of the first of a process, so that its use allocates nothing
  std::mutex mutex_;
  std::vector<std::shared_ptr<ClientLocks>> files_;
  std::vector<Used> pools_;
};

}  // namespace plchost
