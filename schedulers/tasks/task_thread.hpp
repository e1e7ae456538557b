#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "schedulers/tasks/task.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

/// The thread of one task: waits on its source, runs a cycle, and between two cycles exchanges the source or
/// parks. All functions: set-up, from one control thread.
class TaskThread {
 public:
  /// Starts it parked. `task` outlives it.
  [[nodiscard]] static Result<std::unique_ptr<TaskThread>> start(Clock& clock, Task& task,
                                                                 ThreadPriority priority);
  TaskThread(const TaskThread&) = delete;
  TaskThread& operator=(const TaskThread&) = delete;
  /// Ends the thread when its cycle ends, however long that is. One that is parked by its trap is left alone.
  ~TaskThread();

  /// From the end of its cycle on the task waits on `source`; null: parks. The source before is in use until
  /// settled().
  void use(ActivationSource* source) noexcept;
  void park() noexcept { use(nullptr); }
  /// Waits until the thread does what was asked for last, at most until `deadline`, which is real time. A
  /// thread that is parked by its trap does nothing any more: it is settled.
  [[nodiscard]] bool settled(TimePoint deadline) noexcept;
  /// The thread has done what was asked for last, and touches nothing of its task until it is asked again:
  /// it is parked, or its task is in exception.
  [[nodiscard]] bool rests() const noexcept;

 private:
  TaskThread(Clock& clock, Task& task) noexcept : clock_(clock), task_(task) {}
  void run() noexcept;

  Clock& clock_;
  Task& task_;
  std::atomic<ActivationSource*> wanted_{nullptr};
  std::atomic<bool> ending_{false};
  std::atomic<std::uint32_t> order_{0};  // changes with each demand; a parked thread sleeps on it
  std::atomic<std::uint32_t> done_{0};   // the last order that was obeyed; the thread that demands sleeps on
                                         // it
  std::atomic<bool> resting_{false};
  Thread thread_;
};

}  // namespace plchost
