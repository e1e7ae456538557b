#pragma once

#include <atomic>
#include <cstddef>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "instances/plc_app.h"
#include "schedulers/task_set.hpp"

namespace plchost {

/// The handles that applications have on their tasks: the number of the task, counted from 1. Names can be
/// looked up as soon as the application has handed its tasks over, the tasks themselves are there later.
/// Any context, unless said otherwise.
class TaskTable {
 public:
  /// The table that the application handed over, once. Control thread.
  void set_up(const sys_setup_tasks_struct* setup);
  /// The same tasks in the same order, as another version of the application has them. While no cycle runs.
  void exchange(std::span<Task_Info* const> infos) noexcept;
  /// The tasks behind the handles, in the same order; null: none any more, nor does anybody use them. Control
  /// thread.
  void attach(TaskSet* tasks) noexcept { tasks_.store(tasks, std::memory_order_release); }

  /// RTS_INVALID_HANDLE: no task of that name.
  [[nodiscard]] RTS_HANDLE find(std::string_view name) const noexcept;
  /// RTS_INVALID_HANDLE: not one of the application's.
  [[nodiscard]] RTS_HANDLE find(const Task_Info* info) const noexcept;
  /// Null: no such handle, or the tasks are not made yet.
  [[nodiscard]] Task* task(RTS_HANDLE handle) const noexcept;
  /// All of them; null: they are not made yet.
  [[nodiscard]] TaskSet* tasks() const noexcept { return tasks_.load(std::memory_order_acquire); }

 private:
  /// Names of our own: those of an application go with it.
  struct Row {
    std::string name;
    std::atomic<const Task_Info*> info{nullptr};
  };
  std::deque<std::deque<Row>> made_;  // those of a second call, too: it is refused later
  std::atomic<const std::deque<Row>*> rows_{nullptr};
  std::atomic<TaskSet*> tasks_{nullptr};
};

/// Says on this thread whose cycle it runs, as long as it exists: for plc_current_task(). Real-time.
class CurrentTask {
 public:
  explicit CurrentTask(Task_Info* task) noexcept;
  ~CurrentTask();
  CurrentTask(const CurrentTask&) = delete;
  CurrentTask& operator=(const CurrentTask&) = delete;
};

/// The task whose code this thread runs; null: none. Any context.
[[nodiscard]] Task_Info* current_task() noexcept;

}  // namespace plchost
