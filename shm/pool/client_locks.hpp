#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <sys/types.h>

#include "shm/base/result.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/threads/client_mutex.hpp"

namespace plchost {

/// Tells the users of a pool across containers that run from those that have ended, in every PID namespace.
///
/// Each process has a number, and a lock on the byte of that number in the file POOL.clients (fcntl(2),
/// F_SETLK). The kernel lets go of it at every end of the process and at exec(), and at no other time. A
/// child of fork() does not have it, and the end of a thread does not matter. Others ask the kernel whether
/// the byte is locked. A number is never given twice.
///
/// Any close() of the file lets go of all locks that the process has on it. So one descriptor serves all
/// pools of that file in the process, it stays open when they go, and nothing else opens the file. A second
/// copy of this library in the process (an application that links libplcpool) has another descriptor and
/// another number.
class ClientLocks final : public ClientRoll {
 public:
  /// POOL.clients.
  [[nodiscard]] static std::string file_name(std::string_view pool);
  /// Makes the file if it is not there, for the users who may write the pool: one who only reads could lock
  /// the bytes of others. The result is its number on its file system. refused: it belongs to a user that
  /// `owners` does not allow.
  [[nodiscard]] static Result<std::uint64_t> make(const std::string& pool, const MemoryRights& rights,
                                                  const OwnerCheck& owners);
  /// corrupt: it is not the file of that number any more, or not there. refused: its rights do not allow it.
  [[nodiscard]] static Result<std::shared_ptr<ClientLocks>> open(const std::string& pool, std::uint64_t file);
  /// Gives the file the rights that follow from those of the pool. Well if there is none. Set-up.
  [[nodiscard]] static Result<void> renew_rights(const std::string& pool, const MemoryRights& rights);
  ~ClientLocks();
  ClientLocks(const ClientLocks&) = delete;
  ClientLocks& operator=(const ClientLocks&) = delete;

  /// The number of the calling process; the next one of `numbers` if it has none yet, as a child of fork().
  /// 0: the kernel gives no lock. Any context; the first call of a process has system calls.
  [[nodiscard]] std::uint32_t number(std::atomic<std::uint32_t>& numbers) noexcept {
    const std::uint32_t known = number_.load(std::memory_order_relaxed);
    return known != 0 ? known : take_number(numbers);
  }
  /// Takes the lock again if the program has closed the descriptor, or another one of the file. With a lock
  /// that another process has got meanwhile the number is lost, and there is a new one. Set-up.
  [[nodiscard]] Result<void> renew(std::atomic<std::uint32_t>& numbers) noexcept;

  /// See make().
  [[nodiscard]] std::uint64_t file() const noexcept { return file_; }
  [[nodiscard]] bool lives(std::uint32_t client) const noexcept override;
  /// The number of the process in the PID namespace of the caller; 0: it has ended, or cannot be seen from
  /// there. Set-up.
  [[nodiscard]] pid_t seen_as(std::uint32_t client) const noexcept;

 private:
  friend class ProcessPools;
  ClientLocks(std::string path, int fd, std::uint64_t device, std::uint64_t file) noexcept
      : path_(std::move(path)), device_(device), file_(file), fd_(fd) {}
  [[nodiscard]] std::uint32_t take_number(std::atomic<std::uint32_t>& numbers) noexcept;
  [[nodiscard]] std::uint32_t take_number_locked(std::atomic<std::uint32_t>& numbers) noexcept;
  [[nodiscard]] bool is_open() const noexcept;
  [[nodiscard]] bool is_nameless() const noexcept;

  const std::string path_;
  const std::uint64_t device_;
  const std::uint64_t file_;
  std::atomic<int> fd_;
  std::atomic<std::uint32_t> number_{0};
};

}  // namespace plchost
