#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "schedulers/activation/scheduler.hpp"
#include "schedulers/activation/single_cycle.hpp"
#include "schedulers/distributed_clock/distributed_clock.hpp"
#include "schedulers/faults/cycle_gate.hpp"
#include "schedulers/supervision/starvation.hpp"
#include "schedulers/supervision/supervision.hpp"
#include "schedulers/tasks/priorities.hpp"
#include "schedulers/tasks/task.hpp"
#include "schedulers/tasks/task_config.hpp"
#include "schedulers/tasks/task_thread.hpp"
#include "schedulers/tick/tick_source.hpp"
#include "schedulers/tick/ticker.hpp"
#include "shm/base/counted_event.hpp"
#include "shm/base/flight_ring.hpp"
#include "shm/base/result.hpp"
#include "shm/base/task_statistics.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

// The life of a set of tasks
// ==========================
//
//      create()           start()            all are read               switch_to()
//     ─────────► stopped ─────────► looking ──────────────► running ◄──────────────► exchanging
//                 ▲   │                                        │
//      all parked │   │ begin_single_cycle()                   │ begin_stop(), park_all()
//                 │   ▼                                        ▼
//                 │  single cycle ─────── begin_stop() ─────► stopping
//                 └───────────────────────────────────────────┘
//
//   stopped       All task threads are parked, the ticker rests. Posts are counted as lost.
//   looking       The ticker reads each event variable for the first time. From these levels the first edges
//                 rise. The origin of all grids is chosen after that.
//   running       Each thread waits on its source: the scheduler's (cyclic, freewheeling), or the kind's own
//                 (event, external event). The ticker runs if the scheduler ticks, or if there are event
//                 variables. between_cycles() holds all threads outside of the application's code for
//                 microseconds.
//   exchanging    The new scheduler, its tick source and all sources are made. The ticker exchanges the
//                 scheduler between two ticks. Then each thread takes its new source at the end of its cycle.
//   single cycle  Each cyclic and freewheeling task runs once, one after the other, under no scheduler.
//   stopping      Tasks that drive outputs park at the end of their cycles. Then the ticker rests, and the
//                 others park. Each of the two phases has a limit.
//
// A fault, a watchdog, or a variable that does not return puts a task into exception in any of these states.
// The task never runs again, and start() is refused. By its policy, no other task begins a cycle either.
//
// Task threads and the ticker exist as long as the set, and each follows
// the order that it was given last: TaskThread::use(), Ticker::use(), and settled() when it does. The
// supervision watches them. All functions of the set are called by one control thread. A scheduler that is
// given up, with its sources, is freed when every thread has settled.

/// Where tasks find what lies outside: given by the instance (the pool), or by a test.
struct TaskEnvironment {
  /// The counter behind an external event's name. Called once per external task in create(). It outlives the
  /// TaskSet.
  std::function<Result<CountedEvent*>(std::string_view event)> find_event;
  /// Zeroed memory for the statistics of task number `index`. It outlives the TaskSet.
  std::function<TaskStatistics&(std::size_t index)> statistics;
  /// Zeroed memory that shows the fault of task number `index` to other processes. May be empty. It outlives
  /// the TaskSet.
  std::function<Seqlock<FaultRecord>&(std::size_t index)> fault_record;
  /// Tells that a task's thread runs cycles (true) or is parked (false). May be empty. Called by the control
  /// thread, from within start(), stop() and switch_to().
  std::function<void(std::size_t index, bool running)> state_changed;
  /// Tells that a task was asked to park: after the cycle that it is in it takes no release any more. Told in
  /// the phase of the stop that the task belongs to. May be empty. Called by the control thread,
  /// from within begin_stop() and advance_stop().
  std::function<void(std::size_t index)> to_park;
  /// Tells that no task begins another cycle: a fault of the whole application. May be empty. Called by its
  /// finder, in a signal handler perhaps, and once more for each further one.
  std::function<void()> halted{};
  /// Where task number `index` tells of its cycles. May be empty. The memory outlives the TaskSet.
  std::function<FlightRing(std::size_t index)> flight{};
  FlightRing control_flight{};  ///< where the control thread tells what it does with all tasks
  FlightRing watch_flight{};    ///< where the supervision tells of hits and of its own delays
  FlightRing poll_flight{};     ///< where the reader of event variables tells of long readings
  /// Faults and endless loops in the application's code put their task into exception: handlers for signals
  /// are installed in this process (see install_fault_handlers()), and a thread supervises the tasks. Without
  /// it a fault ends the process.
  bool catch_faults = false;
  /// For development, and tests in places without the right to SCHED_FIFO: all threads run as SCHED_OTHER, so
  /// neither priorities nor times hold.
  bool allow_unprivileged = false;
  /// Where clock devices are opened.
  DeviceFiles* devices = &linux_device_files();
};

/// The tasks of one application with their threads, under one scheduler that can be exchanged while they run.
/// All functions are set-up, from one control thread.
class TaskSet {
 public:
  /// Beyond this an event variable that is read is taken for one that never returns. It is above the time of
  /// the watchdog, which knows more.
  static constexpr Duration kVariablePatience = std::chrono::seconds(3);
  /// Between start() and the first release, so that all threads wait when it comes.
  static constexpr Duration kStartLead = std::chrono::milliseconds(2);
  /// How long start() and switch_to() wait for tasks to take their new source. A task whose cycle takes
  /// longer takes it when the cycle ends.
  static constexpr Duration kSwitchPatience = std::chrono::milliseconds(100);
  /// The least time that a thread gets, after the deadline of a stop was first seen to be over, before it is
  /// judged.
  static constexpr Duration kSecondLook = std::chrono::milliseconds(20);
  /// How long a stop waits for a task that is in no cycle and only has not had the processor.
  static constexpr Duration kIdlePatience = std::chrono::seconds(2);

  /// Validates all tasks (names unique, priorities 0..31, an interval where one is needed ...), makes them,
  /// and starts their threads parked. The error names the task and what is allowed.
  [[nodiscard]] static Result<std::unique_ptr<TaskSet>> create(Clock& clock, PriorityBand band,
                                                               std::vector<TaskConfig> tasks,
                                                               TaskEnvironment environment);
  TaskSet(const TaskSet&) = delete;
  TaskSet& operator=(const TaskSet&) = delete;
  /// Stops everything; waits for the cycles that are running, however long they take.
  ~TaskSet();

  /// A start that cannot fail any more. Used before the next call of prepare() that succeeds, of
  /// begin_single_cycle() or of switch_to(), or not at all.
  class Prepared;
  /// Takes all steps of a start that can fail, and starts nothing. wrong_state: the tasks run already, or one
  /// of them has not come back since stop(), or is in exception. unsupported, invalid_argument: the scheduler
  /// refuses these settings.
  [[nodiscard]] Result<Prepared> prepare(std::string_view scheduler, const SchedulerSettings& settings);
  /// Releases the tasks under the scheduler that was prepared. External events posted while the tasks were
  /// stopped are not run but counted as lost. Edges of event variables are not run: the level at the start
  /// counts as seen. An event variable that does not return from being read for the first time puts its task
  /// into exception.
  void start(Prepared prepared);
  /// The two of them, one after the other.
  [[nodiscard]] Result<void> start(std::string_view scheduler, const SchedulerSettings& settings);
  /// Parks all tasks at the end of their cycles, those that drive outputs first. Waits, at most `limit` (real
  /// time, from when all were asked to) for each of the two phases; longer only for a task in no cycle.
  /// timed_out: names the tasks that did not come back in time; they are parked when they do. wrong_state:
  /// they do not run.
  [[nodiscard]] Result<void> stop(Duration limit);
  /// The same without waiting: begins it. Then advance_stop() until it is over; until then running() holds.
  [[nodiscard]] Result<void> begin_stop(const StopLimits& limits);
  /// Looks how far the stop is, and goes on to its second phase. Nothing: it is not over yet. Else it is: the
  /// tasks that have not come back in time.
  [[nodiscard]] std::optional<std::vector<std::size_t>> advance_stop();
  /// The task whose event variable was still being read when the last stop timed out. Nothing ends the thread
  /// that reads it; start() is refused until that read returns.
  [[nodiscard]] std::optional<std::size_t> late_variable() const noexcept { return late_variable_; }
  [[nodiscard]] bool stop_begun() const noexcept { return stop_.has_value(); }
  /// Stops without waiting for any cycle, also if a stop is under way. For what went wrong.
  void park_all();
  /// Parked tasks that were not yet reported are; the names of those that are still in their cycles at the
  /// deadline. While the tasks are stopped.
  std::vector<std::string_view> still_busy(TimePoint deadline) { return wait_until_settled(deadline); }
  /// Lets each cyclic and freewheeling task run one cycle, one after the other by priority, whatever the
  /// scheduler. When single_cycle_done(), or at any time before, it is ended by a stop. `before`: called when
  /// it is certain that they will run, and none does yet. wrong_state: as start().
  [[nodiscard]] Result<void> begin_single_cycle(const SchedulerSettings& settings,
                                                const std::function<void()>& before = {});
  /// Each has come back from its cycle, or never will.
  [[nodiscard]] bool single_cycle_done() noexcept;
  /// Tasks that the last stop has kept from their turn in a single cycle. By priority.
  [[nodiscard]] const std::vector<std::size_t>& left_out() const noexcept { return left_out_; }
  /// "Main, Report"
  [[nodiscard]] std::string names_of(const std::vector<std::size_t>& tasks) const;
  /// Exchanges the scheduler. Running tasks keep their grid, their backlog of events, counters and variables.
  /// On failure they run on under the old one. wrong_state: they do not run. timed_out: an event variable
  /// does not return, which puts its task, and all, into exception.
  [[nodiscard]] Result<void> switch_to(std::string_view scheduler, const SchedulerSettings& settings);

  /// Runs `action` in a moment in which no task is in a cycle and no event variable is read, under any
  /// scheduler. Cycles that would begin meanwhile begin after it, and no release is lost unless the action
  /// takes longer than a period. For how long that was. Nothing: there was no such moment now, nothing was
  /// done and nobody had to wait; try again. `action` is short, and does nothing that waits.
  [[nodiscard]] std::optional<Duration> between_cycles(const std::function<void()>& action);
  /// Some task stands still in the middle of a cycle: see Task::stand_still(). Within an action of
  /// between_cycles().
  [[nodiscard]] bool stands_still() const noexcept;
  /// Those that are within a cycle just now, or in their event variables. None whose thread a fault has ended
  /// there: it never goes on, but has_parked_thread() then.
  [[nodiscard]] std::vector<std::string_view> tasks_in_cycle() const;

  /// In the order in which they were given. The calls on a task that each context may make: see Task.
  [[nodiscard]] std::size_t size() const noexcept { return tasks_.size(); }
  [[nodiscard]] Task& task(std::size_t index) noexcept { return *tasks_[index]; }
  /// The clock that the grids of the cyclic tasks follow, under a scheduler that can move releases.
  [[nodiscard]] DistributedClock& distributed_clock() noexcept { return distributed_clock_; }

  /// A fault, or a watchdog's hit, of one task.
  struct Fault {
    std::size_t task = 0;  ///< its index
    std::string name;
    FaultRecord record;
    TimePoint time;  ///< as the flight recorder has it
    BackTrace back_trace;
    bool whole_application = true;  ///< false: the policy is `task`, the others run on
  };
  /// Readable when take_fault() has something new. Valid as long as this object.
  [[nodiscard]] int fault_fd() const noexcept { return fault_fd_.get(); }
  /// The next fault that was not taken yet, in the order of the tasks; nothing if there is none. Its task
  /// never runs again. If it is one of the whole application, no task begins another cycle: only stop() is
  /// left, and then a fresh process.
  [[nodiscard]] std::optional<Fault> take_fault();
  /// Of tasks of external events. Those that are stopped or in exception: posts since then are counted as
  /// lost. Those that run: one that sleeps although it was posted to is woken; its poster was ended in
  /// between. To be called every 100 ms.
  void look_after_posts() noexcept;
  /// Finds threads of this process that take the processor from the thread that watches the tasks, where
  /// ProcessorGuard has not: they lose their real-time priority. The lines to log about those, and about
  /// programs that keep tasks from the processor. To be called every 100 ms.
  [[nodiscard]] std::vector<std::string> look_after_processor();
  /// The names of the tasks that are in exception, and so keep start() from it.
  [[nodiscard]] std::vector<std::string_view> tasks_in_exception() const;
  /// A thread was caught in the application's code and is parked there for good. Nothing waits for it, and
  /// this object can be destroyed.
  [[nodiscard]] bool has_parked_thread() const noexcept;

  /// The statistics of that task, or of all if the name is empty, begin anew; whether tasks run or not.
  /// not_found: no such task; the text lists what there is. timed_out: a task has been recording a cycle for
  /// so long, because others keep it from running; those before it in the list are reset.
  [[nodiscard]] Result<void> reset_statistics(std::string_view task);
  static constexpr Duration kRecordPatience = std::chrono::seconds(1);

  /// Of the scheduler in use, or of the last one.
  [[nodiscard]] TickReport tick_report() const { return report_of(tick_); }

  [[nodiscard]] bool running() const noexcept { return running_; }
  /// Of the scheduler in use, or of the last one; empty before the first start.
  [[nodiscard]] std::string_view scheduler_name() const noexcept { return scheduler_name_; }

 private:
  /// A scheduler and what it made for the tasks, in their order.
  struct Arrangement {
    std::unique_ptr<Scheduler> scheduler;  // or a single cycle
    std::unique_ptr<SingleCycle> single_cycle;
    TickChoice tick;
    TickPlan plan;
    std::vector<std::unique_ptr<ActivationSource>> sources;
  };

  struct Stop {
    StopLimits limits;
    bool others;         // the second phase; no initializer: clang would not let an optional have it
    bool hurried;        // no cycle is waited for
    TimePoint deadline;  // of the phase
    std::optional<TimePoint> judged_from;  // of the phase, once the deadline is over
    std::vector<std::size_t> stuck;
  };

  TaskSet(Clock& clock, PriorityBand band, TaskEnvironment environment, UniqueFd fault_fd);
  [[nodiscard]] Result<void> supervise();
  [[nodiscard]] Result<void> add(TaskConfig config);
  [[nodiscard]] Result<std::unique_ptr<Arrangement>> arrange(std::string_view name,
                                                             const SchedulerSettings& settings);
  [[nodiscard]] Result<void> plan_ticks(Arrangement& arrangement, const SchedulerSettings& settings);
  [[nodiscard]] bool tick_by(Arrangement& arrangement);
  void watch(const SchedulerSettings& settings);
  [[nodiscard]] Result<void> reset_statistics(Task& task);
  [[nodiscard]] Result<void> check_startable();
  void hand_out_sources();
  void report(std::size_t index, bool running);
  void begin_second_phase();
  void park_tasks(bool that_drive_outputs);
  void note_left_out();
  std::vector<std::size_t> busy_in_phase();
  [[nodiscard]] bool runs_code(std::size_t task) const noexcept;
  [[nodiscard]] std::optional<std::vector<std::size_t>> stuck_in_phase(const std::vector<std::size_t>& busy);
  [[nodiscard]] std::optional<std::size_t> task_in_variable() const noexcept;
  void watch_variables(const SchedulerSettings& settings);
  [[nodiscard]] bool ticker_follows();
  void raise_late_variable(std::size_t task);
  [[nodiscard]] bool let_retired_go();
  std::vector<std::string_view> wait_until_settled(TimePoint deadline);

  Clock& clock_;
  PriorityBand band_;
  TaskEnvironment environment_;
  UniqueFd fault_fd_;
  FaultBoard fault_board_;
  CycleGate gate_;
  EventPoller poller_{clock_, gate_};  // the supervision watches its trap
  TickChoice tick_;
  bool running_ = false;
  DistributedClock distributed_clock_;
  std::optional<Stop> stop_;
  std::optional<std::size_t> late_variable_;
  TimePoint origin_;  // of all grids, until the next start()
  std::string_view scheduler_name_;
  std::vector<std::unique_ptr<Task>> tasks_;
  std::vector<bool> reported_running_;
  std::vector<std::size_t> single_cycle_order_;  // indices of tasks
  std::vector<std::size_t> left_out_;            // the same
  std::vector<bool> fault_taken_;
  std::optional<Supervision> supervision_;  // until all threads have ended
  TakerSearch takers_{linux_processor_times()};
  TimePoint starved_told_;  // when a task was told of last that other programs keep from the processor
  std::unique_ptr<Arrangement> active_;
  std::vector<std::unique_ptr<Arrangement>>
      retired_;  // a task in a long cycle, or the ticker in an event variable, may still use one of these
  TickPlan first_look_;
  Ticker ticker_{clock_, poller_};
  std::vector<std::unique_ptr<TaskThread>> threads_;  // last: they use all of the above
};

class TaskSet::Prepared {
 private:
  friend class TaskSet;
  Prepared(std::unique_ptr<Arrangement> arrangement, const SchedulerSettings& settings)
      : arrangement_(std::move(arrangement)), settings_(settings) {}

  std::unique_ptr<Arrangement> arrangement_;
  SchedulerSettings settings_;
};

}  // namespace plchost
