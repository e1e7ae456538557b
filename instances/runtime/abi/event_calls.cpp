// The calls of applications and components about external events: see plc_app.h.

#include "instances/runtime/application/application_host.hpp"
#include "shm/log/log.hpp"

using plchost::ApplicationHost;

RTS_HANDLE SchedRegisterExternalEvent(const char* pszEvent, RTS_RESULT* pResult) {
  const auto finish = [&](RTS_RESULT result, RTS_HANDLE handle) {
    if (pResult != nullptr) *pResult = result;
    return handle;
  };
  ApplicationHost* const host = ApplicationHost::current_for_control();
  if (host == nullptr) return finish(ERR_NOTINITIALIZED, RTS_INVALID_HANDLE);
  if (pszEvent == nullptr) return finish(ERR_PARAMETER, RTS_INVALID_HANDLE);
  const auto handle = host->events().open(pszEvent);
  if (!handle) {
    spdlog::error("SchedRegisterExternalEvent: {}", handle.error().describe());
    const bool name = handle.error().code == plchost::ErrorCode::invalid_argument;
    return finish(name ? ERR_PARAMETER : ERR_NOMEMORY, RTS_INVALID_HANDLE);
  }
  const RTS_RESULT registered = host->register_event(*handle);
  const bool given = registered == ERR_OK || registered == ERR_DUPLICATE;
  return finish(registered, given ? *handle : RTS_INVALID_HANDLE);
}

RTS_RESULT SchedUnregisterExternalEvent(RTS_HANDLE hEvent) {
  ApplicationHost* const host = ApplicationHost::current_for_control();
  return host == nullptr ? ERR_NOTINITIALIZED : host->unregister_event(hEvent);
}

RTS_RESULT SchedPostExternalEvent(RTS_HANDLE hEvent) {
  ApplicationHost* const host = ApplicationHost::current();
  return host == nullptr ? ERR_NOTINITIALIZED : host->events().post(hEvent);
}

RTS_RESULT EventRegisterCallbackFunction(unsigned int EventId, PF_EVENT_CALLBACK pfCallback, void* pUser) {
  ApplicationHost* const host = ApplicationHost::current_for_control();
  return host == nullptr ? ERR_NOTINITIALIZED : host->add_callback(EventId, pfCallback, pUser);
}

RTS_RESULT EventUnregisterCallbackFunction(unsigned int EventId, PF_EVENT_CALLBACK pfCallback, void* pUser) {
  ApplicationHost* const host = ApplicationHost::current_for_control();
  return host == nullptr ? ERR_NOTINITIALIZED : host->remove_callback(EventId, pfCallback, pUser);
}

RTS_RESULT CAL_SysEventSet(RTS_HANDLE hEvent) {
  ApplicationHost* const host = ApplicationHost::current();
  return host == nullptr ? ERR_NOTINITIALIZED : host->events().set(hEvent);
}
