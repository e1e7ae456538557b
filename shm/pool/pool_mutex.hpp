#pragma once

#include <atomic>
#include <cstdint>

#include "shm/pool/client_locks.hpp"
#include "shm/threads/client_mutex.hpp"
#include "shm/threads/robust_mutex.hpp"

namespace plchost {

/// A mutex of a pool as one process uses it: inheriting priority, or, in a pool across containers, by the
/// number of the process. See RobustMutex and ClientMutex, which lie in the same place. Cheap to make.
class PoolMutex {
 public:
  /// `locks`: null if the pool is not across containers.
  PoolMutex(RobustMutex& place, ClientLocks* locks, std::atomic<std::uint32_t>& numbers) noexcept
      : place_(&place), locks_(locks), numbers_(&numbers) {}

  [[nodiscard]] static ClientMutex& across(RobustMutex& place) noexcept {
    return reinterpret_cast<ClientMutex&>(place);
  }
  [[nodiscard]] static const ClientMutex& across(const RobustMutex& place) noexcept {
    return reinterpret_cast<const ClientMutex&>(place);
  }

  /// In a child of fork(): its thread holds nothing of what its parent held.
  static void forget_held() noexcept;

  // Any context.

  [[nodiscard]] LockResult lock(TimePoint deadline) noexcept {
    return locks_ == nullptr ? place_->lock(deadline) : lock_across(deadline);
  }
  [[nodiscard]] LockResult try_lock() noexcept {
    return locks_ == nullptr ? place_->try_lock() : try_lock_across();
  }
  bool unlock() noexcept { return locks_ == nullptr ? place_->unlock() : unlock_across(); }
  /// The thread that holds it, as it numbers itself; 0: none.
  [[nodiscard]] std::uint32_t thread() const noexcept {
    return locks_ == nullptr ? place_->owner() : across(*place_).thread();
  }
  /// Another number for each other holder: of the thread, or of the process; 0: none.
  [[nodiscard]] std::uint32_t holder() const noexcept {
    return locks_ == nullptr ? place_->owner() : across(*place_).client();
  }
  /// Its holder has ended. Set-up; only reads.
  [[nodiscard]] bool holder_has_ended() const noexcept {
    return locks_ == nullptr ? place_->owner_has_ended() : across(*place_).owner_has_ended(*locks_);
  }

 private:
  [[nodiscard]] ClientThread self() const noexcept;
  [[nodiscard]] LockResult lock_across(TimePoint deadline) noexcept;
  [[nodiscard]] LockResult try_lock_across() noexcept;
  bool unlock_across() noexcept;

  RobustMutex* place_;
  ClientLocks* locks_;
  std::atomic<std::uint32_t>* numbers_;
};

}  // namespace plchost
