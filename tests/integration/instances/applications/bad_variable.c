/* Each with another variable that is refused. */
#include "../../../../instances/plc_app.h"

static short here = 0;
#ifdef BAD_TWICE
static const RTS_RESULT expected = ERR_DUPLICATE;
#else
static const RTS_RESULT expected = ERR_OK;
#endif

static void cycle(void) {}

static Task_Info task = {"Main", 1, Cyclic, 0, 100, 0, "", cycle, 0, 0, 0, 0, 0, 0};
static sys_setup_tasks_struct setup = {1, "BadVariable", &task};

PLC_EXPORT_ABI;

int plc_app_init(void) {
  Plc_Variable variable = {
      sizeof(Plc_Variable), "Main.there", PLC_TYPE_INT, 0, &here, 0, 0, {{0, 0, 0}}, 0, 0};
  __sys__setup__tasks(&setup);
#ifdef BAD_ADDRESS
  variable.pAddress = (void*)16;
#endif
#ifdef BAD_CONSTANT
  variable.pAddress = (void*)(unsigned long)&expected;
#endif
#ifdef BAD_TASK
  variable.pszTask = "Mian";
#endif
#ifdef BAD_TWICE
  plc_declare_variable(&variable);
  variable.pszName = "MAIN.THERE";
#endif
  return plc_declare_variable(&variable) == expected ? 0 : 1;
}
