// The functions of plc_app.h for memory areas.

#include "instances/runtime/application/application_host.hpp"

using plchost::ApplicationHost;

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
