#pragma once

#include <functional>
#include <optional>
#include <string>

#include "manager/store/instance_wish.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// Keeps what one instance is to be: in shared memory for the next manager, on the disk for a power cut.
/// Nothing in it waits for the disk, but for find(), and that within a limit.
class WishKeeper {
 public:
  /// `problem`: why a power cut would undo it; empty: it would not.
  using Kept = std::function<void(const std::string& problem)>;

  virtual ~WishKeeper() = default;
  /// The wish that was kept last. Nothing: the instance is new on this host. corrupt: something was, and
  /// cannot be read. timed_out: the disk that may have it does not answer. To be called once, before all
  /// else.
  [[nodiscard]] virtual Result<std::optional<InstanceWish>> find() = 0;
  /// Is in shared memory when it returns, and on the disk later.
  virtual void keep(const InstanceWish& wish) = 0;
  /// The external events that operators registered are others now: those are kept, too.
  virtual void keep_events() = 0;
  /// Calls `kept` when all that was given so far is on the disk, or cannot be: at once, or later.
  virtual void when_kept(Kept kept) = 0;
  /// Something is being written: it must not be destroyed yet.
  [[nodiscard]] virtual bool is_writing() const = 0;
};

}  // namespace plchost
