#pragma once

#include <string>
#include <utility>

#include "shm/base/result.hpp"
#include "shm/pool/pool_layout.hpp"

namespace plchost {

/// Holds the pool's mutex for set-up. Released at the end of its life, and by the kernel if the process dies.
class PoolLock {
 public:
  /// Makes the mutex of a new pool.
  static Result<void> make_mutex(PoolHeader& header);

  /// timed_out: another one holds it for longer than kPatience. corrupt: it was scribbled over.
  static Result<PoolLock> acquire(PoolHeader& header, const std::string& pool);

  PoolLock(PoolLock&& other) noexcept
      : header_(std::exchange(other.header_, nullptr)), owner_died_(other.owner_died_) {}
  PoolLock& operator=(PoolLock&&) = delete;
  ~PoolLock();

  /// The last owner died while it held the mutex: what it guards must be repaired, then make_consistent()
  /// called.
  [[nodiscard]] bool owner_died() const noexcept { return owner_died_; }
  void make_consistent() noexcept;

 private:
  PoolLock(PoolHeader& header, bool owner_died) noexcept : header_(&header), owner_died_(owner_died) {}
  PoolHeader* header_;
  bool owner_died_;
};

}  // namespace plchost
