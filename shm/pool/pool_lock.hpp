#pragma once

#include <string>
#include <utility>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/pool/memory_trash.hpp"
#include "shm/pool/pool_clients.hpp"
#include "shm/pool/pool_journal.hpp"
#include "shm/pool/pool_layout.hpp"
#include "shm/pool/pool_mutex.hpp"

namespace plchost {

/// Holds the pool's mutex for set-up. Released at the end of its life, and found by the next one if the
/// process ends. Readers without the right to write see by the header's `changes` whether it is held.
class PoolLock {
 public:
  /// Set-up under the mutex takes microseconds. It is only held for longer by a process that was stopped, or
  /// that makes the lists of a large pool anew which a stranger has damaged.
  static constexpr Duration kPatience = std::chrono::milliseconds(100);

  /// timed_out: another one holds it for longer than `patience`. corrupt: it was scribbled over.
  /// `mutex`: the header's. `clients`: by which the holder is told to people.
  static Result<PoolLock> acquire(PoolMutex mutex, PoolHeader& header, PoolJournal& journal,
                                  const PoolClients& clients, const std::string& pool,
                                  Duration patience = kPatience);

  PoolLock(PoolLock&& other) noexcept
      : trash(std::move(other.trash)),
        burying(other.burying),
        mutex_(other.mutex_),
        header_(std::exchange(other.header_, nullptr)),
        journal_(other.journal_),
        owner_died_(other.owner_died_) {}
  PoolLock& operator=(PoolLock&&) = delete;
  ~PoolLock();

  /// The last owner ended while it held the mutex: its unfinished step must be undone.
  [[nodiscard]] bool owner_died() const noexcept { return owner_died_; }

  /// The files that are taken away with the lock held, and go after its release.
  MemoryTrash trash;
  /// Dead clients still hold something.
  bool burying = false;

 private:
  PoolLock(PoolMutex mutex, PoolHeader& header, PoolJournal& journal, bool owner_died) noexcept;
  PoolMutex mutex_;
  PoolHeader* header_;
  PoolJournal* journal_;
  bool owner_died_;
};

}  // namespace plchost
