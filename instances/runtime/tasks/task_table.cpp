#include "instances/runtime/tasks/task_table.hpp"

#include <cstring>
#include <iterator>
#include <span>

#include "instances/runtime/tasks/handle.hpp"

namespace plchost {

namespace {

// An application's table is checked only after it was handed over: it may be anything.
std::span<const Task_Info> tasks_of(const sys_setup_tasks_struct* setup) noexcept {
  if (setup == nullptr || setup->ptaskinfo == nullptr) return {};
  if (setup->nTasks < 1 || setup->nTasks > PLC_MAX_TASKS) return {};
  return {setup->ptaskinfo, static_cast<std::size_t>(setup->nTasks)};
}

std::string_view name_of(const Task_Info& task) noexcept {
  return {std::begin(task.stName), ::strnlen(std::begin(task.stName), sizeof task.stName)};
}

}  // namespace

void TaskTable::set_up(const sys_setup_tasks_struct* setup) {
  std::deque<Row>& rows = made_.emplace_back();
  for (const Task_Info& task : tasks_of(setup)) {
    Row& row = rows.emplace_back();
    row.name = name_of(task);
    row.info.store(&task, std::memory_order_relaxed);
  }
  rows_.store(&rows, std::memory_order_release);
}

void TaskTable::exchange(std::span<Task_Info* const> infos) noexcept {
  std::deque<Row>& rows = made_.back();
  for (std::size_t i = 0; i < rows.size() && i < infos.size(); ++i) {
    rows[i].info.store(infos[i], std::memory_order_relaxed);
  }
}

RTS_HANDLE TaskTable::find(std::string_view name) const noexcept {
  const std::deque<Row>* const rows = rows_.load(std::memory_order_acquire);
  for (std::size_t i = 0; rows != nullptr && i < rows->size(); ++i) {
    if ((*rows)[i].name == name) return to_handle(i);
  }
  return RTS_INVALID_HANDLE;
}

RTS_HANDLE TaskTable::find(const Task_Info* info) const noexcept {
  const std::deque<Row>* const rows = rows_.load(std::memory_order_acquire);
  for (std::size_t i = 0; rows != nullptr && i < rows->size(); ++i) {
    if ((*rows)[i].info.load(std::memory_order_relaxed) == info) return to_handle(i);
  }
  return RTS_INVALID_HANDLE;
}

Task* TaskTable::task(RTS_HANDLE handle) const noexcept {
  TaskSet* const tasks = tasks_.load(std::memory_order_acquire);
  const std::size_t index = index_of(handle);
  if (tasks == nullptr || index >= tasks->size()) return nullptr;
  return &tasks->task(index);
}

namespace {

thread_local Task_Info* task_here = nullptr;

}  // namespace

CurrentTask::CurrentTask(Task_Info* task) noexcept {
  task_here = task;
}
CurrentTask::~CurrentTask() {
  task_here = nullptr;
}

Task_Info* current_task() noexcept {
  return task_here;
}

}  // namespace plchost
