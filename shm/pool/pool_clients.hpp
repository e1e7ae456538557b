#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

#include "shm/base/time.hpp"
#include "shm/pool/pool_view.hpp"

namespace plchost {

/// Who uses a pool. All functions need the pool's mutex.
class PoolClients {
 public:
  explicit PoolClients(const PoolView& view) noexcept : view_(view) {}

  /// The calling process with the process start `start`. Null: there are kMaxClients already.
  [[nodiscard]] ClientSlot* join(std::uint32_t pid, std::uint64_t start, std::string_view name) noexcept;
  /// It has released all that it held.
  static void leave(ClientSlot& client) noexcept { client.pid.store(0, std::memory_order_relaxed); }
  /// Hands each client whose process has ended to `bury`, which releases what it held. Each is looked at
  /// closely every kLook, and each time if `thoroughly`: one that was reaped is known at once in any case.
  void sweep(TimePoint now, bool thoroughly, const std::function<void(ClientSlot&)>& bury);

  /// For so long a process that is a zombie, or whose number was given to another one, passes for alive.
  static constexpr Duration kLook = std::chrono::milliseconds(10);

 private:
  PoolView view_;
};

/// Of the calling process, as others see it: its program's name.
[[nodiscard]] std::string_view program_name() noexcept;

}  // namespace plchost
