#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "schedulers/tasks/event_latch.hpp"
#include "schedulers/tasks/task.hpp"
#include "shm/base/flight_ring.hpp"

namespace plchost {

/// The event tasks of a set: looks at their variables whenever it is told to.
class EventPoller {
 public:
  /// `gate`: that each look passes.
  EventPoller(Clock& clock, CycleGate& gate) noexcept : clock_(clock), gate_(gate) {}

  /// An event task, which is polled from now on. Set-up, before the first look.
  void add(Task& task);
  /// `max_backlog` >= 1: of edges that are raised by call, the runs that a task may lag behind. The thread
  /// that polls.
  void set_max_backlog(std::uint64_t max_backlog) noexcept { max_backlog_ = max_backlog; }
  /// A reading that takes this long is told in `ring`, whose memory outlives this. Set-up, before the first
  /// look.
  static constexpr Duration kToldReading = std::chrono::microseconds(100);
  void tell_in(FlightRing ring) noexcept { flight_ = ring; }
  /// Catches what is faulty in the variables' code. Any thread.
  [[nodiscard]] FaultTrap& trap() noexcept { return trap_; }
  [[nodiscard]] const FaultTrap& trap() const noexcept { return trap_; }
  [[nodiscard]] bool empty() const noexcept { return polled_.empty(); }
  /// Takes the levels of the variables that were never read since their task began: from them the first edge
  /// rises. The thread that polls.
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
  std::uint64_t max_backlog_ = 1;
  FaultTrap trap_;
  CycleGate& gate_;
  std::vector<Polled> polled_;
  FlightRing flight_;
};

}  // namespace plchost
