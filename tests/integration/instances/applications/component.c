/* A component: it is told of the task that waits for "work", and sets that task's event from a thread of its
 * own. */
#include <pthread.h>
#include <string.h>
#include <time.h>

#include "../../../../instances/plc_app.h"

static volatile RTS_HANDLE work_event = RTS_INVALID_HANDLE;
static volatile int stopping;
static pthread_t thread;

PLC_EXPORT_ABI;

static void CDECL on_event_task(unsigned int EventId, const EVTPARAM_ExternalEventTask* pParam, void* pUser) {
  (void)pUser;
  if (strcmp(pParam->pTaskInfo->stExternalEvent, "work") != 0) return;
  work_event = EventId == EVT_ExternalEventTaskCreateDone ? pParam->hEvent : RTS_INVALID_HANDLE;
}

static void* run(void* unused) {
  struct timespec pause;
  pause.tv_sec = 0;
  pause.tv_nsec = 2000000;
  while (!stopping) {
    RTS_HANDLE event = work_event;
    if (event != RTS_INVALID_HANDLE) CAL_SysEventSet(event);
    nanosleep(&pause, NULL);
  }
  return unused;
}

RTS_RESULT CDECL HookFunction(unsigned int ulHook, unsigned long ulParam1, unsigned long ulParam2) {
  (void)ulParam1;
  (void)ulParam2;
  switch (ulHook) {
    case CH_INIT3:
      plc_log(PLC_LOG_INFO, "component: CH_INIT3");
      EventRegisterCallbackFunction(EVT_ExternalEventTaskCreateDone, on_event_task, NULL);
      EventRegisterCallbackFunction(EVT_PrepareExternalEventTaskDelete, on_event_task, NULL);
      return pthread_create(&thread, NULL, run, NULL) == 0 ? ERR_OK : ERR_FAILED;
    case CH_EXIT3:
      plc_log(PLC_LOG_INFO,
              work_event == RTS_INVALID_HANDLE ? "component: event forgotten" : "component: stale event");
      stopping = 1;
      pthread_join(thread, NULL);
      return ERR_OK;
    default:
      return ERR_OK;
  }
}
