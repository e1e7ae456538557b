#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <vector>

#include "schedulers/activation_gate.hpp"
#include "schedulers/task.hpp"

namespace plchost {

/// The tasks that one tick releases: each task's thread states for when it waits, each tick opens the gates
/// of those that are due. A task that is still busy has stated nothing, so its tick passes; the task counts
/// that itself.
class TickTable {
 public:
  explicit TickTable(Clock& clock) noexcept : clock_(clock) {}

  /// The source of a cyclic or freewheeling task. Set-up.
  [[nodiscard]] std::unique_ptr<ActivationSource> add(const Task& task, FreewheelRule rule);

  [[nodiscard]] bool empty() const noexcept { return slots_.empty(); }

  /// Orders the table by priority and takes `tick` as the last tick that passed. Set-up, after the last
  /// add().
  void start(TimePoint tick) noexcept;

  /// Releases what is due at `tick`, the highest priority first; how many. Depends on nothing but `tick` and
  /// the table. One thread, real-time.
  std::size_t on_tick(TimePoint tick) noexcept;

 private:
  class Slot;

  Clock& clock_;
  std::vector<Slot*> slots_;
  std::atomic<Duration::rep> last_tick_{0};
};

}  // namespace plchost
