// The calls of applications about their tasks: see plc_app.h.

#include "instances/runtime/application/application_host.hpp"
#include "instances/runtime/tasks/task_table.hpp"

using plchost::ApplicationHost;
using plchost::Task;

namespace {

// The task behind the handle, or why there is none.
RTS_RESULT find_task(RTS_HANDLE handle, Task*& task) noexcept {
  ApplicationHost* const host = ApplicationHost::current();
  if (host == nullptr || host->in_init() || host->task_table().tasks() == nullptr) return ERR_NOTINITIALIZED;
  task = host->task_table().task(handle);
  return task == nullptr ? ERR_PARAMETER : ERR_OK;
}

}  // namespace

RTS_HANDLE SchedGetTaskHandle(const char* pszTask, RTS_RESULT* pResult) {
  const auto finish = [&](RTS_RESULT result, RTS_HANDLE handle) {
    if (pResult != nullptr) *pResult = result;
    return handle;
  };
  ApplicationHost* const host = ApplicationHost::current();
  if (host == nullptr) return finish(ERR_NOTINITIALIZED, RTS_INVALID_HANDLE);
  if (pszTask == nullptr) return finish(ERR_PARAMETER, RTS_INVALID_HANDLE);
  const RTS_HANDLE handle = host->task_table().find(pszTask);
  return finish(handle == RTS_INVALID_HANDLE ? ERR_NO_OBJECT : ERR_OK, handle);
}

Task_Info* plc_current_task() {
  return plchost::current_task();
}

RTS_HANDLE SchedGetCurrentTask() {
  ApplicationHost* const host = ApplicationHost::current();
  return host == nullptr ? RTS_INVALID_HANDLE : host->task_table().find(plchost::current_task());
}

RTS_RESULT SchedGetTaskInterval(RTS_HANDLE hTask, RTS_I64* pIntervalNs) {
  Task* task = nullptr;
  if (const RTS_RESULT found = find_task(hTask, task); found != ERR_OK) return found;
  if (pIntervalNs == nullptr || !task->kind().has_grid) return ERR_PARAMETER;
  *pIntervalNs = task->interval().count();
  return ERR_OK;
}

RTS_RESULT SchedSetTaskInterval(RTS_HANDLE hTask, RTS_I64 nIntervalNs) {
  Task* task = nullptr;
  if (const RTS_RESULT found = find_task(hTask, task); found != ERR_OK) return found;
  return task->set_interval(plchost::Duration(nIntervalNs)) ? ERR_OK : ERR_PARAMETER;
}

RTS_RESULT SchedRaiseEvent(RTS_HANDLE hTask) {
  Task* task = nullptr;
  if (const RTS_RESULT found = find_task(hTask, task); found != ERR_OK) return found;
  return task->raise_event() ? ERR_OK : ERR_PARAMETER;
}
