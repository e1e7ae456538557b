/* A component that cannot be initialised, and says so in a trial. */
#include "../../../instances/plc_app.h"

PLC_EXPORT_ABI;

RTS_RESULT CDECL HookFunction(unsigned int ulHook, unsigned long ulParam1, unsigned long ulParam2) {
  (void)ulParam1;
  (void)ulParam2;
  return ulHook == CH_INIT || ulHook == CH_TRIAL ? ERR_FAILED : ERR_OK;
}
