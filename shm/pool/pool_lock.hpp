#pragma once

#include <string>
#include <utility>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/pool/pool_layout.hpp"

namespace plchost {

/// Holds the pool's mutex for set-up. Released at the end of its life, and found by the next one if the
/// process dies. Readers without the right to write see by the header's `changes` whether it is held.
class PoolLock {
 public:
  /// Set-up under the mutex takes microseconds, a repair of the largest pool some 100 ms.
  static constexpr Duration kPatience = std::chrono::seconds(5);

  /// timed_out: another one holds it for longer than `patience`. corrupt: it was scribbled over.
  static Result<PoolLock> acquire(PoolHeader& header, const std::string& pool, Duration patience = kPatience);

  PoolLock(PoolLock&& other) noexcept
      : header_(std::exchange(other.header_, nullptr)), owner_died_(other.owner_died_) {}
  PoolLock& operator=(PoolLock&&) = delete;
  ~PoolLock();

  /// The last owner died while it held the mutex: what it guards must be repaired.
  [[nodiscard]] bool owner_died() const noexcept { return owner_died_; }

 private:
  PoolLock(PoolHeader& header, bool owner_died) noexcept;
  PoolHeader* header_;
  bool owner_died_;
};

}  // namespace plchost
