// The calls of a debug build: see plc_debug.h.

#include <cstdint>

#include "instances/plc_debug.h"
#include "instances/runtime/application/application_host.hpp"
#include "instances/runtime/tasks/handle.hpp"
#include "instances/runtime/tasks/task_table.hpp"

using plchost::ApplicationHost;
using plchost::DebugTask;

namespace {

constinit thread_local Plc_Frame* top_frame = nullptr;
constinit thread_local std::uint64_t cycle_number = 0;
constinit thread_local const Task_Info* known_info = nullptr;
constinit thread_local DebugTask* known_task = nullptr;

// Null: code that no task runs.
DebugTask* task_here() noexcept {
  const Task_Info* const info = plchost::current_task();
  if (info == nullptr || info == known_info) return info == nullptr ? nullptr : known_task;
  ApplicationHost* const host = ApplicationHost::current();
  if (host == nullptr) return nullptr;
  // Another version has other descriptions of the same tasks.
  known_task = host->debug().task(plchost::index_of(host->task_table().find(info)));
  known_info = info;
  return known_task;
}

}  // namespace

RTS_RESULT plc_debug_declare_pou(Plc_Pou* pPou) {
  ApplicationHost* const host = ApplicationHost::current_for_control();
  return host == nullptr ? ERR_NOTINITIALIZED : host->declare_pou(pPou);
}

RTS_RESULT plc_debug_declare_instance(const Plc_Pou* pPou, const void* pSelf, const char* pszPath) {
  ApplicationHost* const host = ApplicationHost::current_for_control();
  return host == nullptr ? ERR_NOTINITIALIZED : host->declare_pou_instance(pPou, pSelf, pszPath);
}

void plc_debug_enter(Plc_Frame* pFrame) {
  pFrame->pCaller = top_frame;
  pFrame->dwDepth = top_frame == nullptr ? 0 : top_frame->dwDepth + 1;
  if (top_frame == nullptr) ++cycle_number;
  top_frame = pFrame;
}

void plc_debug_leave(Plc_Frame* pFrame) {
  top_frame = pFrame->pCaller;
  if (__builtin_expect(__atomic_load_n(&plc_debug_armed, __ATOMIC_RELAXED) == 0, 1)) return;
  if (DebugTask* const task = task_here()) task->leave(*pFrame);
}

void plc_debug_statement(Plc_Frame* pFrame) {
  if (DebugTask* const task = task_here())
    task->statement(*pFrame, __builtin_return_address(0), cycle_number);
}
