/* Variables of characters, of one byte and of units of UTF-16. */
#include <string.h>
#include <uchar.h>

#include "instances/plc_app.h"
#include "instances/plc_variables.h"

PLC_EXPORT_ABI;

static char letter = 'a';
static unsigned char odd = 0xff;
static char16_t sign = 0x20ac;
static char16_t half = 0xd83d;
static char16_t title[8] = u"press";
static char16_t copy[8]; /* of `title`, made by each cycle */
static char16_t names[2][4] = {u"one", u"two"};
static char16_t full[3] = {'x', 'y', 'z'}; /* no zero ends it */
static int same;                           /* whether `title` is `copy` */

static void CDECL cycle(void) {
  same = memcmp(copy, title, sizeof copy) == 0;
  memcpy(copy, title, sizeof copy);
}

static void declare_names(void) {
  Plc_Variable variable;
  memset(&variable, 0, sizeof variable);
  variable.dwSize = sizeof variable;
  variable.pszName = "names[]";
  variable.dwType = PLC_TYPE_WSTRING;
  variable.pAddress = &names[0][0];
  variable.dwBytes = sizeof names[0];
  variable.nDimensions = 1;
  variable.aDimensions[0].nFirst = 1;
  variable.aDimensions[0].nCount = 2;
  variable.aDimensions[0].dwStride = sizeof names[0];
  plc_declare_variable(&variable);
}

int CDECL plc_app_init(void) {
  static Task_Info task;
  static sys_setup_tasks_struct setup;
  strcpy(task.stName, "Main");
  task.KindOfTask = Cyclic;
  task.nPriority = 1;
  task.dwInterval = 2;
  task.dwTaskEntryFunctionPointer = cycle;
  strcpy(setup.stApplicationName, "Characters");
  setup.nTasks = 1;
  setup.ptaskinfo = &task;
  PLC_DECLARE_VARIABLE("letter", PLC_TYPE_CHAR, letter);
  PLC_DECLARE_VARIABLE("odd", PLC_TYPE_CHAR, odd);
  PLC_DECLARE_VARIABLE("sign", PLC_TYPE_WCHAR, sign);
  PLC_DECLARE_VARIABLE("half", PLC_TYPE_WCHAR, half);
  PLC_DECLARE_ARRAY("letters[]", PLC_TYPE_WCHAR, title, 0);
  PLC_DECLARE_WSTRING("title", title);
  PLC_DECLARE_WSTRING("copy", copy);
  PLC_DECLARE_WSTRING("full", full);
  PLC_DECLARE_VARIABLE("same", PLC_TYPE_DINT, same);
  declare_names();
  __sys__setup__tasks(&setup);
  return 0;
}
