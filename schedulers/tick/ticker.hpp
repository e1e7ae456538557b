#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "schedulers/activation/activation_gate.hpp"
#include "schedulers/activation/event_poller.hpp"
#include "schedulers/tick/tick_source.hpp"
#include "shm/base/thread.hpp"

namespace plchost {

/// A thread of a scheduler that does something at each tick. All functions but the callback: set-up, one
/// thread.
class Ticker {
 public:
  using OnTick = std::function<void(TimePoint tick)>;

  /// `on_tick` is called on the ticker's thread with the planned time of the tick; real-time. `poller` is
  /// primed there before the first tick. Nothing waits for a thread that is parked in a faulty variable, and
  /// only so long for one that is in a variable that does not return.
  Ticker(const SchedulerContext& context, std::string thread_name, EventPoller& poller, OnTick on_tick);
  Ticker(const Ticker&) = delete;
  Ticker& operator=(const Ticker&) = delete;
  ~Ticker() { (void)stop(kNoDeadline); }

  /// Makes the tick source and the thread, which waits.
  [[nodiscard]] Result<void> prepare();
  /// The first point of the grid origin + n * scheduler_interval that is not over.
  [[nodiscard]] TimePoint first_tick(TimePoint origin) const noexcept;
  /// Returns when the event variables have been read for the first time. After prepare(). false: they have
  /// not, for kVariablePatience; it ticks once they have.
  [[nodiscard]] bool prime() noexcept;
  /// Ticks at `first` and then every scheduler_interval. After prime().
  void start(TimePoint first) noexcept;
  /// Ends the thread; true: it has ended before `deadline` (real time), or is parked. May be called again.
  [[nodiscard]] bool stop(TimePoint deadline) noexcept;

 private:
  void run() noexcept;

  SchedulerContext context_;
  Clock& clock_;
  Duration period_;
  std::string thread_name_;
  EventPoller& poller_;
  OnTick on_tick_;
  std::unique_ptr<TickSource> source_;
  ActivationGate go_;    // to the variables
  ActivationGate tick_;  // to the first tick
  std::atomic<bool> stopping_{false};
  TimePoint first_;  // written before tick_ opens
  std::atomic<std::uint32_t> primed_{0};
  Thread thread_;
};

}  // namespace plchost
