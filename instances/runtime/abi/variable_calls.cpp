// The calls of an application about its variables that are seen from outside: see plc_variables.h.

#include "instances/plc_app.h"
#include "instances/runtime/application/application_host.hpp"
#include "instances/runtime/memory/task_cycle.hpp"

using plchost::ApplicationHost;
using plchost::TaskCycle;

RTS_RESULT plc_declare_variable(const Plc_Variable* pVariable) {
  ApplicationHost* const host = ApplicationHost::current_for_control();
  return host == nullptr ? ERR_NOTINITIALIZED : host->declare_variable(pVariable);
}

void plc_apply_forces() {
  if (const TaskCycle* const cycle = TaskCycle::here()) cycle->apply_forces();
}
