#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "schedulers/activation/activation.hpp"
#include "schedulers/clock.hpp"
#include "schedulers/distributed_clock/settings.hpp"
#include "schedulers/task/task_config.hpp"
#include "shm/base/result.hpp"

namespace plchost {

class CycleGate;
class FaultTrap;
class Task;
class TickDevice;

/// 100: a freewheeling task sleeps no longer than it must.
inline constexpr int kMaxProcessorLoad = 100;
/// More than any wake-up latency that spinning is an answer to.
inline constexpr Duration kMaxSpinAhead = std::chrono::milliseconds(1);

/// system: a timer of the kernel. task: a thread of high priority in absolute sleeps. auxiliary: a clock
/// device with an interrupt of its own.
enum class TickSourceKind : std::uint8_t { system, task, auxiliary };

/// The watchdogs that concern the instance as a whole.
struct WatchdogSettings {
  bool load =
      true;  ///< the load watchdog: at processor_load_maximum percent, or if that is not set at overload
  Duration load_interval = std::chrono::seconds(1);  ///< over which the load is measured
  bool omitted_cycles = true;                        ///< the tasks' watchdogs of omitted cycles may hit
  Duration default_time = std::chrono::seconds(2);   ///< of an endless loop in a task without a time; 0: off
  bool operator==(const WatchdogSettings&) const = default;
};

/// The settings of [CmpSchedule] and [SysTimer], already validated by whoever read them.
struct SchedulerSettings {
  Duration scheduler_interval =
      std::chrono::milliseconds(1);   ///< the tick, and how often event variables are polled
  Duration freewheeling_cycletime{};  ///< fixed sleep of freewheeling tasks; 0: a share of the execution time
  int processor_load_maximum =
      0;  ///< percent, 1..100; freewheeling tasks sleep (100-M) %; 0: not set, sleep 20 %
  TickSourceKind tick_source = TickSourceKind::system;
  std::string auxiliary_device = "/dev/rtc0";  ///< of TickSourceKind::auxiliary
  Duration spin_ahead_max =
      std::chrono::microseconds(100);  ///< bound of the guard of CmpScheduleOneShot; 0: off
  std::uint64_t max_event_backlog = std::uint64_t{1}
                                    << 20;  ///< external events a task may lag behind before it drops
  DistributedClockSettings distributed_clock;
  WatchdogSettings watchdog;
  bool operator==(const SchedulerSettings&) const = default;
};

/// The parts that a scheduler is made of.
struct SchedulerContext {
  Clock& clock;
  SchedulerSettings settings;
  ThreadPriority tick;                        ///< of its own threads: above all tasks
  FaultTrap* poll_trap = nullptr;             ///< of the thread that reads event variables; null: not caught
  CycleGate* gate = nullptr;                  ///< that this thread passes for it; null: none
  std::shared_ptr<TickDevice> tick_device{};  ///< of TickSourceKind::auxiliary, its period set
};

struct SchedulerCapabilities {
  bool one_shot = false;  ///< releases may be moved each cycle (distributed clocks)
  bool external_event_breakpoints = false;
};

/// Beyond this an event variable that is read is taken for one that never returns. It is above the time of
/// the watchdog, which knows more.
inline constexpr Duration kVariablePatience = std::chrono::seconds(3);

/// Policy only: decides when which task is activated. Threads, statistics and the switch are TaskSet's.
/// Life: source_for() for each task, prepare(), prime(), start(), stop(); then it is done with.
class Scheduler {
 public:
  virtual ~Scheduler() = default;
  [[nodiscard]] virtual std::string_view name() const noexcept = 0;
  [[nodiscard]] virtual SchedulerCapabilities capabilities() const noexcept = 0;
  /// Set-up. The task outlives the source, the source does not outlive the scheduler.
  [[nodiscard]] virtual Result<std::unique_ptr<ActivationSource>> source_for(Task& task) = 0;
  /// Set-up, after the last source_for(). Makes everything that can fail to be made, its threads above all;
  /// nothing is released yet. So a switch that cannot succeed fails while the scheduler before still runs.
  [[nodiscard]] virtual Result<void> prepare() = 0;
  /// Set-up. Reads the event variables that were never read since their task began, on the thread that polls
  /// them: from these levels the first edges rise. Before the origin is chosen, because it may take long.
  /// false: one has not returned for kVariablePatience.
  [[nodiscard]] virtual bool prime() noexcept = 0;
  /// Set-up, after prime(), whatever that said. Never waits. Ticks and polls lie on the grid origin + n *
  /// scheduler_interval. Grids of tasks are the tasks' own.
  virtual void start(TimePoint origin) noexcept = 0;
  /// Ends the scheduler's own threads; waits for that, at most until `deadline` (real time). true: nothing of
  /// a task is touched any more. Sources may still be waited on and are then only left by interrupt(). false:
  /// not yet, as long as an event variable does not return. Set-up; may be called again, and without a
  /// start().
  [[nodiscard]] virtual bool stop(TimePoint deadline) noexcept = 0;
};

/// A scheduler that can be chosen by name. A new one is a file of its own and a line in registry.cpp.
struct SchedulerEntry {
  std::string_view name;
  std::unique_ptr<Scheduler> (*make)(const SchedulerContext&);
};

/// invalid_argument: a value is out of its range; the text says which and what is allowed.
[[nodiscard]] Result<void> check_settings(const SchedulerSettings& settings);

[[nodiscard]] std::span<const SchedulerEntry> all_schedulers() noexcept;
/// "CmpSchedule, CmpScheduleTimer, CmpScheduleOneShot"
[[nodiscard]] std::string scheduler_names();
/// invalid_argument: no such scheduler; the text lists what there is.
[[nodiscard]] Result<const SchedulerEntry*> find_scheduler(std::string_view name);

}  // namespace plchost
