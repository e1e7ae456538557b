#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "schedulers/clock/clock.hpp"
#include "schedulers/settings/scheduler_settings.hpp"
#include "schedulers/tasks/activation.hpp"
#include "shm/base/result.hpp"

namespace plchost {

class Task;

/// The parts that a scheduler is made of. The clock outlives it.
struct SchedulerContext {
  Clock& clock;
  SchedulerSettings settings;
  std::uint32_t tick_frequency = 0;  ///< of the clock device that ticks, Hz; 0: the ticks come from `clock`
};

/// The features of a policy that its tasks may need.
struct SchedulerCapabilities {
  bool ticks = false;     ///< on_tick() releases its tasks, so the ticks lie on their grid
  bool one_shot = false;  ///< releases may be moved each cycle (distributed clocks)
};

/// Policy only: decides when each cyclic and freewheeling task is activated. Threads, the tick, event
/// variables, statistics and the switch are TaskSet's. A switch makes a new scheduler with its sources, and
/// exchanges it between two ticks.
class Scheduler {
 public:
  /// Whether breakpoints in tasks of external events halt under it; else they are ignored. A class of
  /// policies/ may say otherwise. The debugger asks before there is a scheduler, so it is in its entry.
  static constexpr bool kHaltsExternalTasks = false;

  virtual ~Scheduler() = default;
  [[nodiscard]] virtual std::string_view name() const noexcept = 0;
  [[nodiscard]] virtual SchedulerCapabilities capabilities() const noexcept = 0;
  /// The source of a cyclic or freewheeling task. The task outlives the source, the source does not outlive
  /// the scheduler. Set-up, before the first tick.
  [[nodiscard]] virtual Result<std::unique_ptr<ActivationSource>> source_for(Task& task) = 0;
  /// A tick of the grid origin + n * scheduler_interval, its planned time. The first call names the tick that
  /// has passed when the scheduler comes into use; no task waits under it yet. The ticker's thread,
  /// real-time. A scheduler without the capability `ticks` is not told of any.
  virtual void on_tick(TimePoint /*tick*/) noexcept {}
};

}  // namespace plchost
