#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include <sys/types.h>

#include "shm/base/memory_guard.hpp"
#include "shm/base/result.hpp"
#include "shm/pool/memory_file.hpp"
#include "shm/pool/pool_lock.hpp"
#include "shm/pool/pool_view.hpp"

namespace plchost {

struct PoolOptions;

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
  [[nodiscard]] bool lost() const noexcept { return guard_.lost(); }

  /// Who holds it finds all lists repaired, and what dead clients held released.
  /// refused: mapped to read only. wrong_state: this process is a child of the one that attached.
  [[nodiscard]] Result<PoolLock> lock(bool look_thoroughly = false, Duration patience = PoolLock::kPatience);

  /// With the lock held. full: too many clients, or too many references.
  [[nodiscard]] Result<ReferenceEntry*> add_reference(ObjectEntry& object, bool writable);
  /// Takes the lock. Nothing is done if it is another's by now.
  void release(ReferenceEntry& reference, std::uint32_t generation) noexcept;
  /// With the lock held. Frees the object if nobody needs it any more.
  void drop_if_idle(ObjectEntry& object) noexcept;
  /// With the lock held. Frees it, whoever needs it.
  void destroy(ObjectEntry& object) noexcept;

 private:
  PoolSegment(std::string name, MemoryFile memory, std::uint32_t max_objects, Access access);
  static Result<std::shared_ptr<PoolSegment>> attach_now(const std::string& name, Access access);
  static Result<std::shared_ptr<PoolSegment>> attach_patiently(const std::string& name, Access access);

  [[nodiscard]] Result<ClientSlot*> client();
  [[nodiscard]] ClientSlot* own_client() const noexcept;
  void repair() noexcept;
  void mend_header() noexcept;
  void release_all(ClientSlot& client) noexcept;
  void release_one(ReferenceEntry& reference) noexcept;

  std::string name_;
  MemoryFile memory_;
  MemoryGuard guard_;  // below the memory, so that it goes first
  PoolView view_;
  Access access_;
  pid_t pid_;
  std::uint64_t start_;
  // Of the slot that this client has; guarded by the pool's mutex.
  ClientSlot* client_ = nullptr;
  std::uint32_t client_generation_ = 0;
};

}  // namespace plchost
