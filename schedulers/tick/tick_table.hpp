#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "schedulers/tasks/task.hpp"
#include "schedulers/tick/due_queue.hpp"

namespace plchost {

/// The tasks that one tick releases. Each task's thread states for when it waits and hands itself in without
/// a lock. The tick queues the tasks that were handed in by their time and takes out those that are due. So
/// its cost depends on these two numbers only, not on the number of tasks.
///
/// The tick wakes only the first of them, and each task wakes the one after it before it runs. The tick
/// outranks all tasks, so the highest priority would otherwise wait until all others were woken. A cycle that
/// blocks or never ends holds up nobody, since the next task was woken before.
///
/// A task that is still busy has stated nothing, so its tick passes; the task counts that itself.
class TickTable {
 public:
  /// The cost of a tick. Only tests read it: they hold it against the number of tasks.
  struct Work {
    std::size_t released = 0;   ///< tasks that were due
    std::size_t looked_at = 0;  ///< tasks that were touched at all
  };

  /// `frequency`: of the device that ticks, Hz; 0: the ticks come from `clock`.
  ///
  /// A device has a time of its own, which drifts against the clock that releases are planned in. So under a
  /// device a task whose interval is a multiple of the tick runs on ticks. Its release is the planned time of
  /// the tick, and its grid follows the device. Other intervals keep the grid of the clock and wait for the
  /// next tick, as always.
  explicit TickTable(Clock& clock, std::uint32_t frequency = 0) noexcept
      : clock_(clock), frequency_(frequency) {}

  /// The source of a cyclic or freewheeling task. Set-up.
  [[nodiscard]] std::unique_ptr<ActivationSource> add(const Task& task, FreewheelRule rule);

  /// Takes `tick` as the last tick that passed. After the last add(), before anybody waits.
  void start(TimePoint tick) noexcept;

  /// Releases what is due at `tick`, in the order of priority. Depends on nothing but `tick` and the table.
  /// One thread, real-time.
  Work on_tick(TimePoint tick) noexcept;

 private:
  class Slot;

  void hand_in(Slot& slot) noexcept;
  void take_in(Duration::rep tick, Work& work) noexcept;
  void take_due(Duration::rep tick, Work& work) noexcept;
  void claim(Slot& slot, Duration::rep due) noexcept;

  [[nodiscard]] bool runs_on_ticks(Duration interval) const noexcept;
  [[nodiscard]] Duration::rep slack(Duration interval) const noexcept;
  [[nodiscard]] Activation on_the_tick(Activation activation, Duration interval) const noexcept;

  Clock& clock_;
  std::uint32_t frequency_;
  std::vector<Slot*> slots_;  // by priority
  std::atomic<Duration::rep> last_tick_{0};
  std::atomic<Duration::rep> device_tick_{0};  // the last one that a device has made
  std::atomic<Slot*> handed_in_{nullptr};  // a list that tasks put themselves on, and a tick takes as a whole
  DueQueue queue_;                         // the tick's alone, like the next
  std::vector<Slot*> due_;
};

}  // namespace plchost
