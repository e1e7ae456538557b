#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include "schedulers/activation/event_poller.hpp"
#include "schedulers/activation/scheduler.hpp"
#include "schedulers/tick/tick_source.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

/// The work of the ticker. It is not changed while the ticker uses it.
struct TickPlan {
  std::unique_ptr<TickSource> source;  ///< null: only the first look at the event variables
  Scheduler* scheduler = nullptr;      ///< told of each tick; null: none
  TimePoint origin;                    ///< ticks lie on the grid origin + n * period
  Duration period{};                   ///< > 0 with a source
  std::uint64_t max_backlog = 1;       ///< of raised edges, the runs that a task may lag behind
};

/// The one thread of a set of tasks that ticks: at each tick it tells the scheduler, and then looks at the
/// event variables. Between two ticks it takes the plan that it was given last. Without one it sleeps. All
/// functions: set-up, from one control thread.
class Ticker {
 public:
  Ticker(Clock& clock, EventPoller& poller) noexcept : clock_(clock), poller_(poller) {}
  Ticker(const Ticker&) = delete;
  Ticker& operator=(const Ticker&) = delete;
  /// Ends the thread, however long an event variable takes. A thread that is parked in one is left alone.
  ~Ticker();

  [[nodiscard]] Result<void> start_thread(ThreadPriority priority);

  /// From the end of the tick under way on the ticker follows `plan`. First it reads the event variables that
  /// were never read since their tasks began, and tells the scheduler of the tick that has passed. It makes
  /// up for a tick that fell due in the exchange. Null: it rests. The plan before is in use until settled().
  void use(TickPlan* plan) noexcept;
  /// Waits until the thread follows the plan that it was given last, at most until `deadline`, which is real
  /// time. A thread that is parked in a faulty variable follows nothing any more: it is settled.
  [[nodiscard]] bool settled(TimePoint deadline) noexcept;

 private:
  void run() noexcept;
  void begin(TickPlan* plan) noexcept;

  Clock& clock_;
  EventPoller& poller_;
  std::atomic<TickPlan*> wanted_{nullptr};
  std::atomic<bool> ending_{false};
  std::atomic<std::uint32_t> order_{0};  // changes with each plan; the thread sleeps on it
  std::atomic<std::uint32_t> done_{0};   // the last order that was obeyed; the control thread sleeps on it
  std::optional<TimePoint> last_tick_;   // the thread's own; nothing: it has rested
  Thread thread_;
};

}  // namespace plchost
