#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "shm/base/time.hpp"
#include "shm/pool/client_locks.hpp"
#include "shm/pool/pool_journal.hpp"
#include "shm/pool/pool_view.hpp"
#include "shm/threads/process_start.hpp"

namespace plchost {

/// The users of a pool. All functions need the pool's mutex.
class PoolClients {
 public:
  /// `locks`: null if the pool is not across containers.
  PoolClients(const PoolView& view, PoolJournal& journal, const ClientLocks* locks) noexcept
      : view_(view), journal_(journal), locks_(locks) {}

  /// The calling process. `self.start`: across containers its number, see ClientLocks. Null: there are
  /// kMaxClients already.
  [[nodiscard]] ClientSlot* join(const ProcessIdentity& self, std::string_view name) noexcept;
  /// Hands each client that has ended to `bury`, which releases what it held, or as much of it as it likes.
  /// In the second case it says false, and the next sweep hands the client over again. Whether the process is
  /// there is looked at closely every kLook, and each time if `thoroughly`: one that was reaped is known at
  /// once in any case. False: `bury` has said so.
  bool sweep(TimePoint now, bool thoroughly, const std::function<bool(ClientSlot&)>& bury);

  [[nodiscard]] bool across_containers() const noexcept { return locks_ != nullptr; }
  /// Across containers: the process of that number, for people. Without the mutex, too.
  [[nodiscard]] std::string describe(std::uint32_t number) const;

  /// For so long a process that is a zombie, or whose number was given to another one, counts as running.
  static constexpr Duration kLook = std::chrono::milliseconds(10);

 private:
  PoolView view_;
  PoolJournal& journal_;
  const ClientLocks* locks_;
};

/// Whether a client has ended, by what its slot says of it. `look`: how closely; across containers each look
/// is close. Set-up.
[[nodiscard]] bool client_has_ended(const ProcessIdentity& client, const ClientLocks* locks,
                                    ProcessLook look = ProcessLook::thorough) noexcept;

/// Of the calling process, as others see it: its program's name.
[[nodiscard]] std::string_view program_name() noexcept;

}  // namespace plchost
