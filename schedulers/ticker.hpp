#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "schedulers/activation_gate.hpp"
#include "schedulers/event_poller.hpp"
#include "schedulers/tick_source.hpp"
#include "shm/base/thread.hpp"

namespace plchost {

/// A thread of a scheduler that does something at each tick. All functions but the callback: set-up, one
/// thread.
class Ticker {
 public:
  using OnTick = std::function<void(TimePoint tick)>;

  /// `on_tick` is called on the ticker's thread with the planned time of the tick; real-time. `poller` is
  /// primed there before the first tick; if its thread is parked in a faulty variable, nothing waits for it.
  Ticker(const SchedulerContext& context, std::string thread_name, EventPoller& poller, OnTick on_tick);
  Ticker(const Ticker&) = delete;
  Ticker& operator=(const Ticker&) = delete;
  ~Ticker() { stop(); }

  /// Makes the tick source and the thread, which waits.
  [[nodiscard]] Result<void> prepare();
  /// The first point of the grid origin + n * scheduler_interval that is not over.
  [[nodiscard]] TimePoint first_tick(TimePoint origin) const noexcept;
  /// Returns when the event variables have been read for the first time. Ticks at `first` and then every
  /// scheduler_interval. After prepare().
  void start(TimePoint first) noexcept;
  void stop() noexcept;

 private:
  void run() noexcept;

  SchedulerContext context_;
  Clock& clock_;
  Duration period_;
  std::string thread_name_;
  EventPoller& poller_;
  OnTick on_tick_;
  std::unique_ptr<TickSource> source_;
  ActivationGate go_;
  std::atomic<bool> stopping_{false};
  TimePoint first_;  // written before go_ opens
  std::atomic<std::uint32_t> primed_{0};
  Thread thread_;
};

}  // namespace plchost
