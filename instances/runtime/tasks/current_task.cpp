#include "instances/runtime/tasks/current_task.hpp"

namespace plchost {

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
