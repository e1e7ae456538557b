#pragma once

#include <atomic>
#include <cstdint>

#include "shm/base/futex.hpp"
#include "shm/base/time.hpp"
#include "shm/threads/robust_mutex.hpp"

namespace plchost {

/// Tells by their numbers whether the users of a shared memory run.
class ClientRoll {
 public:
  /// In doubt it does. Set-up: a system call.
  [[nodiscard]] virtual bool lives(std::uint32_t client) const noexcept = 0;

 protected:
  ~ClientRoll() = default;
};

/// A thread of a user of a shared memory.
struct ClientThread {
  std::uint32_t client = 0;  ///< 1 to ClientMutex::kMaxClient: of its process, and of no other one, ever
  std::uint32_t thread = 0;  ///< its number, in the PID namespace of its process
};

/// A mutex in shared memory whose users may be in several PID namespaces. There the kernel cannot tell from a
/// number which thread is meant, so this one is a plain futex: without priority inheritance. It is robust
/// against the end of its owner at any instruction, as RobustMutex is, and of the same size. All zero is a
/// valid free one.
///
/// The word has the number of the owner's process. The next one asks the roll whether that process runs. A
/// waiter looks every RobustMutex::kLook, so a wake that was lost with a killed process costs no more.
///
/// A thread that ends while its process goes on is not seen by others: the process calls abandon() for it.
class ClientMutex {
 public:
  static constexpr std::uint32_t kMaxClient = (1U << 31U) - 2;

  /// Not taken: no system call. Any context; the deadline bounds it. Never `corrupt`.
  [[nodiscard]] LockResult lock(const ClientThread& self, const ClientRoll& roll,
                                TimePoint deadline = kNoDeadline) noexcept;
  /// timed_out: another thread holds it, or has ended over it. The same, without waiting.
  [[nodiscard]] LockResult try_lock(const ClientThread& self) noexcept;
  /// False, and nothing is done: the thread does not hold it. Any context.
  bool unlock(const ClientThread& self) noexcept;
  /// The thread ends: if it holds the mutex, the next one is told that its owner died. Set-up.
  void abandon(const ClientThread& self) noexcept;
  /// The number of the process that holds it, or another number that no client has; 0: none. Any context.
  [[nodiscard]] std::uint32_t client() const noexcept;
  /// The thread that holds it, for people; 0: none, or not known. Any context.
  [[nodiscard]] std::uint32_t thread() const noexcept;
  /// It is held by a thread or process that has ended. Set-up; only reads.
  [[nodiscard]] bool owner_has_ended(const ClientRoll& roll) const noexcept;

 private:
  [[nodiscard]] bool take(std::uint32_t word, const ClientThread& self) noexcept;

  /// [ somebody may wait : 1 ][ client of the owner : 31 ]
  std::atomic<std::uint32_t> word_{0};
  [[maybe_unused]] std::uint32_t zero_ = 0;
  /// [ client of the owner : 32 ][ its thread : 32 ]; 0: not held, or not told yet.
  std::atomic<std::uint64_t> record_{0};
};

static_assert(sizeof(ClientMutex) == sizeof(RobustMutex) && alignof(ClientMutex) == alignof(RobustMutex));

}  // namespace plchost
