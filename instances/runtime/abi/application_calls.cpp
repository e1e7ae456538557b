// The calls of an application about itself when it is loaded, about its start, and its log: see plc_app.h.

#include "instances/runtime/application/application_host.hpp"
#include "shm/base/names.hpp"

using plchost::ApplicationHost;

void __sys__setup__tasks(sys_setup_tasks_struct* p) {
  if (ApplicationHost* const host = ApplicationHost::current_for_control()) host->set_up_tasks(p);
}

RTS_RESULT plc_set_task_options(const char* pszTask, const Task_Options* pOptions) {
  ApplicationHost* const host = ApplicationHost::current_for_control();
  return host == nullptr ? ERR_NOTINITIALIZED : host->set_task_options(pszTask, pOptions);
}

RTS_RESULT plc_prefer_scheduler(const char* pszScheduler) {
  ApplicationHost* const host = ApplicationHost::current_for_control();
  return host == nullptr ? ERR_NOTINITIALIZED : host->prefer_scheduler(pszScheduler);
}

RTS_RESULT plc_keep_variables(const char* pszName, void* pAddress, unsigned int dwBytes, RTS_UI64 qwLayout) {
  ApplicationHost* const host = ApplicationHost::current_for_control();
  if (host == nullptr) return ERR_NOTINITIALIZED;
  return host->keep_variables(
      pszName == nullptr ? std::string() : std::string(plchost::cut(pszName, PLC_MAX_VARIABLE_NAME + 1)),
      {.address = pAddress, .bytes = dwBytes, .layout = qwLayout});
}

int plc_online_change() {
  const ApplicationHost* const host = ApplicationHost::current_for_control();
  return host != nullptr && host->online_change() ? 1 : 0;
}

const char* plc_instance_name() {
  const ApplicationHost* const host = ApplicationHost::current();
  return host == nullptr ? "" : host->instance().c_str();
}

const char* plc_parameter(const char* pszName) {
  const ApplicationHost* const host = ApplicationHost::current();
  return host == nullptr || pszName == nullptr ? nullptr : host->parameter(pszName);
}

int plc_start_kind() {
  const ApplicationHost* const host = ApplicationHost::current();
  return host == nullptr ? PLC_START_FIRST : host->start_kind();
}

void plc_log(int nLevel, const char* pszText) {
  ApplicationHost* const host = ApplicationHost::current();
  if (host != nullptr && pszText != nullptr) host->messages().push(nLevel, pszText);
}

RTS_HANDLE plc_declare_area(const Plc_Area* pArea, RTS_RESULT* pResult) {
  RTS_RESULT result = ERR_NOTINITIALIZED;
  ApplicationHost* const host = ApplicationHost::current_for_control();
  const RTS_HANDLE handle = host == nullptr ? RTS_INVALID_HANDLE : host->declare_area(pArea, result);
  if (pResult != nullptr) *pResult = result;
  return handle;
}

void* plc_area_address(RTS_HANDLE hArea) {
  const ApplicationHost* const host = ApplicationHost::current();
  return host == nullptr || host->in_init() ? nullptr : host->areas().address(hArea);
}

RTS_RESULT plc_get_area_state(RTS_HANDLE hArea, Plc_Area_State* pState) {
  const ApplicationHost* const host = ApplicationHost::current();
  if (host == nullptr || host->in_init()) return ERR_NOTINITIALIZED;
  return pState == nullptr ? ERR_PARAMETER : host->areas().state(hArea, *pState);
}
