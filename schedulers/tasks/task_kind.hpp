#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "schedulers/clock/clock.hpp"
#include "schedulers/tasks/activation.hpp"
#include "schedulers/tasks/freewheel_rule.hpp"
#include "schedulers/tasks/task_config.hpp"
#include "shm/base/counted_event.hpp"
#include "shm/base/result.hpp"
#include "shm/base/task_kind.hpp"

namespace plchost {

class ClockFollower;
class EventLatch;

/// The own ways of tasks of one kind, with the state that they keep over an exchange of the scheduler. Each
/// kind overrides its part. Unless said otherwise: the task's thread, real-time.
class TaskKindState {
 public:
  virtual ~TaskKindState() = default;

  /// Set-up, while the task is parked: edges of that time do not count. Before the variables of
  /// event tasks are read for the first time.
  virtual void forget_edges() noexcept {}
  /// Set-up, while the task is parked: begins anew at `origin`. `takes_posts`: posters are told so.
  virtual void begin(TimePoint /*origin*/, bool /*takes_posts*/) noexcept {}
  virtual void cycle_begins(TimePoint /*release*/) noexcept {}
  /// The cycle for `release` came to its end. By how much the next release was moved to follow a clock.
  virtual Duration cycle_ended(TimePoint /*release*/, TimePoint /*end*/) noexcept { return {}; }

  /// The cycle that ended stood still for so long: the releases of that time are not lost; how many they are.
  virtual std::uint64_t pass_over(TimePoint /*end*/, Duration /*still*/) noexcept { return 0; }

  /// The source of a task that runs when something happens; null: a scheduler says when it runs.
  /// `max_backlog` >= 1: the runs that the task may lag behind. Set-up.
  [[nodiscard]] virtual std::unique_ptr<ActivationSource> own_source(std::uint64_t /*max_backlog*/) {
    return nullptr;
  }
  /// The next run, under a scheduler, of a task that has been ready since `ready`: the same until it has run.
  [[nodiscard]] virtual Activation next_release(TimePoint ready,
                                                const FreewheelRule& /*rule*/) const noexcept {
    return {.release = ready};
  }
  /// Something is due at `now` for which no cycle has begun. Any thread.
  [[nodiscard]] virtual bool is_due(TimePoint /*now*/) const noexcept { return false; }

  // Grids. See Task.
  virtual void follow(ClockFollower& /*follower*/) noexcept {}
  [[nodiscard]] virtual const ClockFollower* follower() const noexcept { return nullptr; }
  [[nodiscard]] virtual bool set_interval(Duration /*interval*/) noexcept { return false; }
  [[nodiscard]] virtual Duration interval() const noexcept { return {}; }
  [[nodiscard]] virtual Duration interval_in_force() const noexcept { return {}; }
  [[nodiscard]] virtual std::optional<TimePoint> due() const noexcept { return std::nullopt; }

  // Variables. Null: the kind looks at none.
  [[nodiscard]] virtual EventLatch* latch() noexcept { return nullptr; }

  // Posts. Null: the kind runs for none.
  [[nodiscard]] virtual CountedEvent* event() const noexcept { return nullptr; }
  /// The event's count up to which posts were run or lost.
  [[nodiscard]] virtual std::uint64_t posts_done() const noexcept { return 0; }
  /// The event's count when the task slept last. Any thread.
  [[nodiscard]] virtual std::uint64_t slept_at() const noexcept { return 0; }
};

/// The parts that a kind is made of. All outlive it.
struct TaskKindContext {
  Clock& clock;
  const TaskConfig& config;
  CountedEvent* event = nullptr;  ///< of a kind that takes posts
};

/// How tasks of one kind run. How an application describes them: see TaskKindTraits.
struct TaskKindEntry {
  TaskKind kind{};
  bool timed = false;          ///< a scheduler says when it runs
  bool has_grid = false;       ///< its releases are planned, and can follow a reference clock
  bool limits_itself = false;  ///< takes the processor time that is left
  /// The settings of this kind are there, and in their range.
  Result<void> (*check)(const TaskConfig&) = nullptr;
  std::unique_ptr<TaskKindState> (*make)(const TaskKindContext&) = nullptr;
};

/// The entry of a kind. The file of the kind instantiates it, see kinds/kind.hpp.
template <TaskKind kKind>
[[nodiscard]] TaskKindEntry make_kind_entry();

/// Null: there is no such kind. Set-up.
[[nodiscard]] const TaskKindEntry* find_task_kind(TaskKind kind) noexcept;

}  // namespace plchost
