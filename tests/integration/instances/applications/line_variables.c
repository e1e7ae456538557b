/* Variables of each kind, for those that look at them from outside. */
#include <string.h>

#include "instances/plc_app.h"
#include "instances/plc_variables.h"

PLC_EXPORT_ABI;

static struct {
  int count;
  int twice;
} fast;
static struct {
  short setpoint;
  int total;
  unsigned char stopped;
  char label[16];
} line = {20, 0, 0, "press"};
static short grid[2][3] = {{10, 11, 12}, {20, 21, 22}};
#ifdef LONG_TEXT
static char note[255];
#endif

static void CDECL run_fast(void) {
  ++fast.count;
  fast.twice = 2 * fast.count;
}
static void CDECL run_slow(void) {
  line.total = line.setpoint + 1;
}

static void declare(const char* name, unsigned int type, void* address, const char* task) {
  Plc_Variable variable;
  memset(&variable, 0, sizeof variable);
  variable.dwSize = sizeof variable;
  variable.pszName = name;
  variable.dwType = type;
  variable.pAddress = address;
  variable.pszTask = task;
  plc_declare_variable(&variable);
}

static void declare_all(void) {
  Plc_Variable variable;
  declare("fast.count", PLC_TYPE_DINT, &fast.count, "Fast");
  declare("fast.twice", PLC_TYPE_DINT, &fast.twice, "Fast");
  declare("line.total", PLC_TYPE_DINT, &line.total, NULL);
  PLC_DECLARE_VARIABLE("line.setpoint", PLC_TYPE_INT, line.setpoint);
  memset(&variable, 0, sizeof variable);
  variable.dwSize = sizeof variable;
  variable.pszName = "line.stopped";
  variable.dwType = PLC_TYPE_BOOL;
  variable.dwFlags = PLC_VARIABLE_READ_ONLY;
  variable.pAddress = &line.stopped;
  plc_declare_variable(&variable);
  PLC_DECLARE_STRING("line.label", line.label);
#ifdef LONG_TEXT
  PLC_DECLARE_STRING("note", note);
#endif
  memset(&variable, 0, sizeof variable);
  variable.dwSize = sizeof variable;
  variable.pszName = "grid[][]";
  variable.dwType = PLC_TYPE_INT;
  variable.pAddress = &grid[0][0];
  variable.nDimensions = 2;
  variable.aDimensions[0].nFirst = 1;
  variable.aDimensions[0].nCount = 2;
  variable.aDimensions[0].dwStride = sizeof grid[0];
  variable.aDimensions[1].nCount = 3;
  variable.aDimensions[1].dwStride = sizeof grid[0][0];
  plc_declare_variable(&variable);
}

int CDECL plc_app_init(void) {
  static Task_Info tasks[2];
  static sys_setup_tasks_struct setup;
  strcpy(tasks[0].stName, "Fast");
  tasks[0].KindOfTask = Cyclic;
  tasks[0].nPriority = 1;
  tasks[0].dwInterval = 2;
  tasks[0].dwTaskEntryFunctionPointer = run_fast;
  strcpy(tasks[1].stName, "Slow");
  tasks[1].KindOfTask = Cyclic;
  tasks[1].nPriority = 5;
  tasks[1].dwInterval = 20;
  tasks[1].dwTaskEntryFunctionPointer = run_slow;
  strcpy(setup.stApplicationName, "Variables");
  setup.nTasks = 2;
  setup.ptaskinfo = tasks;
  declare_all();
  __sys__setup__tasks(&setup);
  return 0;
}
