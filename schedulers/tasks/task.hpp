#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>

#include "schedulers/clock/clock.hpp"
#include "schedulers/distributed_clock/distributed_clock.hpp"
#include "schedulers/faults/cycle_gate.hpp"
#include "schedulers/faults/fault_trap.hpp"
#include "schedulers/faults/overrun_rule.hpp"
#include "schedulers/tasks/activation.hpp"
#include "schedulers/tasks/task_config.hpp"
#include "schedulers/tasks/task_kind.hpp"
#include "schedulers/tasks/task_recorder.hpp"
#include "shm/base/counted_event.hpp"
#include "shm/base/flight_ring.hpp"
#include "shm/base/task_statistics.hpp"

namespace plchost {

/// One IEC task: its function, its statistics, and its TaskKindState. That state outlives an exchange of its
/// ActivationSource: the grid, the place in its external event, the level of its event variable.
class Task {
 public:
  /// `config` is valid; `event` is the counter of config.external_event, null for the other kinds. `board`:
  /// the part that the tasks of a set share; null: alone.
  Task(Clock& clock, TaskConfig config, TaskStatistics& statistics, CountedEvent* event,
       FaultBoard* board = nullptr) noexcept;

  [[nodiscard]] const TaskConfig& config() const noexcept { return config_; }
  [[nodiscard]] const TaskKindEntry& kind() const noexcept { return *kind_; }

  /// Cyclic tasks: from now on each release that is planned is moved as `follower` says; it outlives the
  /// task. Set-up, before the first begin().
  void follow(ClockFollower& follower) noexcept { state_->follow(follower); }
  /// Its cycles pass `gate`, which outlives the task. Set-up, before the first begin().
  void pass(CycleGate& gate) noexcept { gate_ = &gate; }
  /// Its cycles are told in `ring`, whose memory outlives the task. Set-up, before the first begin().
  void tell_in(FlightRing ring) noexcept { flight_ = ring; }
  /// The task whose code this thread runs tells there; null: it runs none. The task's thread, real-time.
  [[nodiscard]] static FlightRing* flight_here() noexcept;
  /// A cycle runs, with all that belongs to it, if it passes a gate. Any thread.
  [[nodiscard]] bool in_cycle() const noexcept { return trap_.seat().taken(); }
  /// Null: it follows no clock. Any context.
  [[nodiscard]] const ClockFollower* follower() const noexcept { return state_->follower(); }

  /// Set-up, while the task is parked, before begin() and before the variables of event tasks are read for
  /// the first time. Edges of the time in which it was parked do not count.
  void forget_edges() noexcept { state_->forget_edges(); }
  /// Set-up, while the task is parked: a new grid from `origin` on. Releases of the time in which it was
  /// parked do not count; posts of that time are lost events. `takes_posts`: it runs for the posts from here
  /// on, and posters are told so from the same moment on.
  void begin(TimePoint origin, bool takes_posts = false);

  /// Its source if no scheduler says when it runs; null: one does. `max_backlog`: the runs that it may lag
  /// behind. Set-up.
  [[nodiscard]] std::unique_ptr<ActivationSource> own_source(std::uint64_t max_backlog) {
    return state_->own_source(max_backlog);
  }
  /// The next run of a cyclic or freewheeling task: the same answer until a cycle has run. The task's thread.
  [[nodiscard]] Activation next_release(const FreewheelRule& rule) const noexcept {
    return state_->next_release(ready_, rule);
  }

  /// Runs one cycle and records it. A C++ exception out of the application's code, or a cycle that the
  /// watchdog does not allow, raises fault(). The task's thread, real-time.
  void run_cycle(const Activation& activation) noexcept;
  /// Calls `wait`, which comes back when the task is to go on: so long its code stands still in the middle of
  /// a cycle. No watchdog counts that time, the task is in no cycle for between_cycles(), and the cycle's
  /// execution time is without it. The task's thread, within its code.
  void stand_still(const std::function<void()>& wait) noexcept;
  /// The releases that passed in cycles that stood still: they are no lost ones. Those of event tasks are the
  /// edges for which no run is kept. Any thread.
  [[nodiscard]] std::uint64_t releases_passed() const noexcept {
    return passed_.load(std::memory_order_relaxed);
  }
  /// Those that releases_passed() does not count yet, of a cycle that has stood still for so long. Only while
  /// `wait` of stand_still() runs.
  [[nodiscard]] std::uint64_t releases_passing(Duration still) const noexcept;
  /// The next cycle is the first from another source. The task's thread.
  void source_changed() noexcept { overruns_.forgive_next(); }

  [[nodiscard]] TaskFault& fault() noexcept { return fault_; }
  [[nodiscard]] const TaskFault& fault() const noexcept { return fault_; }
  [[nodiscard]] FaultTrap& trap() noexcept { return trap_; }
  [[nodiscard]] const FaultTrap& trap() const noexcept { return trap_; }
  /// The run that a task is ready for, as long as it is the same: a cycle that has begun, or a due one that
  /// has not.
  struct Demand {
    std::optional<TimePoint> cycle_since;
    std::optional<TimePoint> due;
    std::uint64_t posts = 0;  ///< external events: the event's count when it slept last
    bool operator==(const Demand&) const = default;
  };
  /// Nothing: the task waits for what is to come, or is at work for the runtime. Any thread.
  [[nodiscard]] std::optional<Demand> demand(TimePoint now) const noexcept;
  /// Since when the task could run if it was not at work for the runtime between two cycles; nothing: it is
  /// at that. Releases of that time are no fault of the application. Any thread.
  [[nodiscard]] std::optional<TimePoint> free_since() const noexcept;
  /// The first release that no cycle has begun for; nothing unless cyclic. Any thread.
  [[nodiscard]] std::optional<TimePoint> due() const noexcept { return state_->due(); }

  /// Cyclic tasks, since they were made: releases lost, and cycles before which none was. Any thread.
  struct Pace {
    std::uint64_t lost = 0;
    std::uint64_t on_time = 0;
  };
  [[nodiscard]] Pace pace() const noexcept;

  /// Cyclic tasks: a new interval, from kMinRuntimeInterval to kMaxInterval. The release that is planned now
  /// stays. The grid goes on from there in steps of the new interval until it is set again, also after an
  /// exchange of the scheduler and after a stop and start. Called within a cycle it already places the
  /// release that follows this cycle. false: not a cyclic task, or out of range. Any context.
  [[nodiscard]] bool set_interval(Duration interval) noexcept { return state_->set_interval(interval); }
  /// The interval that was set last; 0 unless cyclic. Any context.
  [[nodiscard]] Duration interval() const noexcept { return state_->interval(); }
  /// The interval that the grid has now: behind the release that is planned; 0 unless cyclic. The task's
  /// thread, real-time.
  [[nodiscard]] Duration interval_in_force() const noexcept { return state_->interval_in_force(); }

  /// Event tasks: one rising edge by call, released at the scheduler's next poll; n calls are n runs. From
  /// the first call on the task's variable is not looked at any more. false: not an event task. Any context.
  bool raise_event() noexcept;

  /// Null: not an event task.
  [[nodiscard]] EventLatch* latch() noexcept { return state_->latch(); }
  /// External events: wakes the task if it may sleep although its event was posted, because the poster ended
  /// before it woke anybody. Called every 100 ms. Control thread.
  void rouse() noexcept;
  /// External events: counts the posts that were not run as lost. Control thread, while the task's thread
  /// rests.
  void lose_posts() noexcept;

  /// All but the cycle count begins anew. False: a record is under way; try again. Set-up.
  [[nodiscard]] bool reset_statistics() noexcept { return recorder_.reset(clock_.now()); }

 private:
  void tell_start(const Activation& activation, TimePoint start) noexcept;
  [[nodiscard]] bool run_entry() noexcept;
  void look_at_overrun(Duration execution) noexcept;
  void work_between_cycles() noexcept;
  void record(const Activation& activation, TimePoint start, TimePoint end, TimePoint ready) noexcept;
  void pass_over(TimePoint end, Duration still) noexcept;
  void count_passed(std::uint64_t releases) noexcept;

  Clock& clock_;
  TaskConfig config_;
  const TaskKindEntry* kind_;
  CycleGate* gate_ = nullptr;
  TaskRecorder recorder_;
  std::unique_ptr<TaskKindState> state_;

  TimePoint ready_;  // since when it could run: the end of its last cycle
  OverrunRule overruns_;
  TaskFault fault_;
  FaultTrap trap_;
  std::atomic<Duration::rep> free_since_{0};
  std::atomic<std::uint64_t> lost_{0};  // these two: one writer, the task's thread
  std::atomic<std::uint64_t> on_time_{0};
  std::atomic<std::uint64_t> passed_{0};
  Duration stood_still_{};         // these four: the task's thread, in this cycle
  bool single_cycle_ = false;      // no other release is planned
  std::uint64_t lost_before_ = 0;  // edges, when it began to stand still
  FlightRing flight_;
};

}  // namespace plchost
