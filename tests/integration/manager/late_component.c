/* A component that knows nothing of trials, and cannot be initialised. */
#include "../../../instances/plc_app.h"

PLC_EXPORT_ABI;

RTS_RESULT CDECL HookFunction(unsigned int ulHook, unsigned long ulParam1, unsigned long ulParam2) {
  (void)ulParam1;
  (void)ulParam2;
  return ulHook == CH_INIT ? ERR_FAILED : ERR_OK;
}
