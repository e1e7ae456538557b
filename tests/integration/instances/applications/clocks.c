/* Clocks for [SysTime]: good ones, and some that must be refused. A component, too. */
#include <stdlib.h>
#include <time.h>

#include "../../../../instances/plc_app.h"

PLC_EXPORT RTS_RESULT CDECL MySysTimeGetUs(RTS_SYSTIME* pTime);
PLC_EXPORT RTS_RESULT CDECL MySysTimeGetNs(RTS_SYSTIME* pTime);
PLC_EXPORT RTS_RESULT CDECL OtherBaseNs(RTS_SYSTIME* pTime);
PLC_EXPORT RTS_RESULT CDECL StoppedNs(RTS_SYSTIME* pTime);

PLC_EXPORT extern RTS_SYSTIME DataNs;
RTS_SYSTIME DataNs = 1;
PLC_EXPORT RTS_RESULT CDECL CrashNs(RTS_SYSTIME* pTime);

PLC_EXPORT_ABI;

RTS_RESULT CDECL HookFunction(unsigned int ulHook, unsigned long ulParam1, unsigned long ulParam2) {
  (void)ulHook;
  (void)ulParam1;
  (void)ulParam2;
  return ERR_OK;
}

/* 1,000,000 s ahead of CLOCK_MONOTONIC: such a time in an application can only come from here. */
static RTS_SYSTIME now(void) {
  struct timespec value;
  clock_gettime(CLOCK_MONOTONIC, &value);
  return ((RTS_SYSTIME)value.tv_sec + 1000000ul) * 1000000000ul + (RTS_SYSTIME)value.tv_nsec;
}

RTS_RESULT CDECL MySysTimeGetUs(RTS_SYSTIME* pTime) {
  *pTime = now() / 1000ul;
  return ERR_OK;
}

RTS_RESULT CDECL MySysTimeGetNs(RTS_SYSTIME* pTime) {
  *pTime = now();
  return ERR_OK;
}

RTS_RESULT CDECL OtherBaseNs(RTS_SYSTIME* pTime) {
  *pTime = now() + 3600ul * 1000000000ul;
  return ERR_OK;
}

RTS_RESULT CDECL StoppedNs(RTS_SYSTIME* pTime) {
  *pTime = 1000000000ul;
  return ERR_OK;
}

RTS_RESULT CDECL CrashNs(RTS_SYSTIME* pTime) {
  (void)pTime;
  abort();
}
