#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "schedulers/task/task.hpp"

namespace plchost {

/// The event tasks of one scheduler: looks at their variables whenever it is told to.
class EventPoller {
 public:
  /// `max_backlog` >= 1: of edges that are raised by call, the runs that a task may lag behind. `trap`:
  /// catches what is faulty in the variables' code; null: one of its own. `gate`: that each look passes;
  /// null: none.
  EventPoller(Clock& clock, std::uint64_t max_backlog, FaultTrap* trap = nullptr,
              CycleGate* gate = nullptr) noexcept
      : clock_(clock), max_backlog_(max_backlog), trap_(trap != nullptr ? *trap : own_trap_), gate_(gate) {}

  /// The source of an event task, which is polled from now on. Set-up.
  [[nodiscard]] std::unique_ptr<ActivationSource> add(Task& task);
  [[nodiscard]] bool empty() const noexcept { return polled_.empty(); }
  /// Takes the levels of the variables that were never polled since their task began: from them the first
  /// edge rises. On the thread that polls, before its first poll.
  void prime(TimePoint now) noexcept;
  /// Sees the rising edges since the last poll and activates their tasks. One thread, real-time.
  void poll(TimePoint now) noexcept;
  /// The thread that polls was caught in a variable's code and never goes on. Any thread.
  [[nodiscard]] bool parked() const noexcept { return trap_.parked(); }

 private:
  // All that a poll needs, one behind the other.
  struct Polled {
    std::function<bool()> read;
    EventLatch* latch;
    TaskFault* fault;
  };

  template <class Use>
  void read_all(TimePoint now, Use use) noexcept;

  Clock& clock_;
  std::uint64_t max_backlog_;
  FaultTrap own_trap_;
  FaultTrap& trap_;
  CycleGate* gate_;
  std::vector<Polled> polled_;
};

}  // namespace plchost
