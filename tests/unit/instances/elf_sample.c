/* Has what an application must export, and calls nothing. */
#include "../../../instances/plc_app.h"

PLC_EXPORT_ABI;

int CDECL plc_app_init(void) {
  return 0;
}
