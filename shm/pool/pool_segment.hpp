#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <sys/types.h>

#include "shm/base/result.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/pool/client_locks.hpp"
#include "shm/pool/object_pool.hpp"
#include "shm/pool/pool_clients.hpp"
#include "shm/pool/pool_journal.hpp"
#include "shm/pool/pool_lock.hpp"
#include "shm/pool/pool_mutex.hpp"
#include "shm/pool/pool_table.hpp"
#include "shm/pool/pool_view.hpp"
#include "shm/threads/process_start.hpp"

namespace plchost {

/// A pool as one process has it mapped: where it comes from, its lock, its repair, and what this client
/// holds. Lives as long as anything that was opened through it.
class PoolSegment {
 public:
  using Access = MemoryFile::Access;

  static Result<std::shared_ptr<PoolSegment>> attach(const std::string& name, Access access);
  static Result<std::shared_ptr<PoolSegment>> create(const std::string& name, const PoolOptions& options);
  /// Releases what the client still holds.
  ~PoolSegment();
  PoolSegment(const PoolSegment&) = delete;
  PoolSegment& operator=(const PoolSegment&) = delete;

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] const PoolView& view() const noexcept { return view_; }
  [[nodiscard]] bool writable() const noexcept { return access_ == Access::read_write; }

  /// The file was cut short by a stranger.
  [[nodiscard]] bool lost() const noexcept { return memory_.lost(); }
  /// The process that changes the pool has ended over it, and none has come since. Set-up; only reads.
  [[nodiscard]] bool holder_has_ended() const noexcept {
    return knows_clients() && mutex(view_.header().mutex).holder_has_ended();
  }
  /// Its users may be in several PID namespaces.
  [[nodiscard]] bool across_containers() const noexcept { return across_; }
  /// The mutex of an object of the pool, or the header's, as this process uses it. Any context. Across
  /// containers a process that only reads may not use it.
  [[nodiscard]] PoolMutex mutex(RobustMutex& place) const noexcept {
    return {place, locks_.get(), view_.header().client_numbers};
  }
  /// The process that an entry of a list is about has ended. Set-up.
  [[nodiscard]] bool has_ended(const ReferenceInfo& client) const noexcept;
  /// Across containers: the number that it has here; 0: it has ended, or cannot be seen. Set-up.
  [[nodiscard]] pid_t seen_as(std::uint64_t client_number) const noexcept;

  /// Its holder finds no unfinished step. The references of ended clients are released: as many as can be
  /// released in `kBurial` (others have their turn meanwhile), the rest is for the next one. refused: mapped
  /// to read only. wrong_state: this process is a child of the one that attached. timed_out: another one
  /// holds it for longer than `patience`. corrupt: lost, or the lock is.
  [[nodiscard]] Result<PoolLock> lock(bool look_thoroughly = false, Duration patience = PoolLock::kPatience);
  static constexpr Duration kBurial = std::chrono::milliseconds(20);

  /// Since it was called last, or since the pool was attached. From one thread.
  [[nodiscard]] PoolFindings take_findings() noexcept;

  // With the lock held, which is given as a proof.

  [[nodiscard]] PoolTable table(const PoolLock& /*held*/) noexcept { return {view_, journal_}; }
  /// Null: there is none of that name, or only one that ended clients held.
  [[nodiscard]] ObjectEntry* find(PoolLock& held, std::string_view name) noexcept;
  /// full: too many clients, or too many references.
  [[nodiscard]] Result<ReferenceEntry*> add_reference(PoolLock& held, ObjectEntry& object, bool writable);
  /// Frees the object if no reference needs it any more.
  void drop_if_idle(PoolLock& held, ObjectEntry& object) noexcept;
  /// Frees it for any process that needs it.
  void destroy(PoolLock& held, ObjectEntry& object) noexcept;
  /// Keeps it no longer.
  void let_go(PoolLock& held, ObjectEntry& object) noexcept;

  /// Without the lock, and without the right to write: null if there is none, or the index is damaged.
  [[nodiscard]] ObjectEntry* peek(std::string_view name) const noexcept;

  /// Takes the lock; if that is not to be had, the next one who gets it in this process does it. Nothing is
  /// done if the reference is another's by now.
  void release(ReferenceEntry& reference, std::uint32_t generation) noexcept;

 private:
  PoolSegment(std::string name, MemoryFile memory, std::uint32_t max_objects, Access access, bool across,
              std::shared_ptr<ClientLocks> locks);
  static Result<std::shared_ptr<PoolSegment>> make(const std::string& name, MemoryFile memory,
                                                   std::uint32_t max_objects, Access access);
  static Result<std::shared_ptr<PoolSegment>> attach_now(const std::string& name, Access access,
                                                         const OwnerCheck& owners);
  static Result<std::shared_ptr<PoolSegment>> attach_patiently(const std::string& name, Access access,
                                                               const OwnerCheck& owners);

  [[nodiscard]] Result<PoolLock> acquire(Duration patience);
  [[nodiscard]] Result<ClientSlot*> client();
  [[nodiscard]] ClientSlot* own_client() const noexcept;
  void repair(PoolLock& held) noexcept;
  void rebuild(PoolLock& held) noexcept;
  void mend_header() noexcept;
  [[nodiscard]] bool bury(PoolLock& held, ClientSlot& client, std::size_t& left) noexcept;
  void release_late(PoolLock& held) noexcept;
  void release_own(PoolLock& held, ReferenceEntry& reference, std::uint32_t generation) noexcept;
  void release_one(PoolLock& held, ReferenceEntry& reference) noexcept;

  [[nodiscard]] PoolFindings counted() const noexcept;
  [[nodiscard]] std::uint32_t version() const noexcept { return across_ ? kPoolVersionAcross : kPoolVersion; }
  [[nodiscard]] PoolClients clients() noexcept { return {view_, journal_, locks_.get()}; }
  // False: across containers, and it may only read.
  [[nodiscard]] bool knows_clients() const noexcept { return !across_ || locks_ != nullptr; }

  std::string name_;
  MemoryFile memory_;
  PoolView view_;
  Access access_;
  ProcessIdentity process_;
  const bool across_;
  const std::uint64_t pid_namespace_;  // or the file of the locks: see PoolHeader
  std::shared_ptr<ClientLocks> locks_;
  // Guarded by the pool's mutex.
  PoolJournal journal_;
  ClientSlot* client_ = nullptr;  // that this client has
  std::uint32_t client_generation_ = 0;
  /// The holder of the lock when a thread of this process has waited for it in vain: it is not waited for
  /// again as long. 0: none.
  std::atomic<std::uint32_t> stuck_{0};
  PoolFindings told_;
  /// The references that could not be released, since the lock was not to be had.
  std::mutex late_guard_;
  std::vector<std::pair<ReferenceEntry*, std::uint32_t>> late_;
};

}  // namespace plchost
