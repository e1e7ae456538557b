/*
 * Runs the tasks of an application cycle by cycle, by a clock of its own, and prints its declared variables
 * after each cycle: step_application FILE CYCLES TICK_NS. So values of two compilers are compared where no
 * instance would stop between two cycles. A variable is a line: its name, its PLC_TYPE_ and the bytes of each
 * of its elements.
 *
 * It defines each function of plc_app.h: those that the adapters call, as far as a program needs them. The
 * others refuse.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "plc_app.h"
#include "plc_debug.h"

#define MOST_AREAS (PLC_MAX_AREAS + 1) /* area 0 is none */

struct symbol {
  Plc_Variable declared; /* with a name of its own */
  char name[PLC_MAX_SYMBOL_NAME + 1];
};
static struct symbol* symbols;
static unsigned int symbol_count;
static void* areas[MOST_AREAS];
static unsigned long area_count;
static sys_setup_tasks_struct* setup;
static Task_Info* current;
static long long now_ns;

/* ---- The clock ----------------------------------------------------------------------------------------- */

/* That of the adapters, too. */
int clock_gettime(clockid_t clock, struct timespec* time) {
  (void)clock;
  time->tv_sec = now_ns / 1000000000;
  time->tv_nsec = now_ns % 1000000000;
  return 0;
}
RTS_RESULT SysTimeGetNs(RTS_SYSTIME* time) {
  if (time == NULL) return ERR_PARAMETER;
  *time = (RTS_SYSTIME)now_ns;
  return ERR_OK;
}
RTS_RESULT SysTimeGetUs(RTS_SYSTIME* time) {
  if (time == NULL) return ERR_PARAMETER;
  *time = (RTS_SYSTIME)(now_ns / 1000);
  return ERR_OK;
}
unsigned int SysTimeGetMs(void) {
  return (unsigned int)(now_ns / 1000000);
}

/* ---- Calls that a program of Structured Text makes --------------------------------------------------------
 */

void __sys__setup__tasks(sys_setup_tasks_struct* given) {
  setup = given;
}
Task_Info* plc_current_task(void) {
  return current;
}
RTS_RESULT plc_set_task_options(const char* task, const Task_Options* options) {
  return task != NULL && options != NULL ? ERR_OK : ERR_PARAMETER;
}
RTS_RESULT plc_prefer_scheduler(const char* name) {
  return name != NULL ? ERR_OK : ERR_PARAMETER;
}
RTS_HANDLE SchedRegisterExternalEvent(const char* name, RTS_RESULT* result) {
  static char registered;
  if (result != NULL) *result = name != NULL ? ERR_OK : ERR_PARAMETER;
  return name != NULL ? (RTS_HANDLE)&registered : RTS_INVALID_HANDLE;
}
/* Nothing is restored, and no event is posted: no callback is due. */
RTS_RESULT EventRegisterCallbackFunction(unsigned int, PF_EVENT_CALLBACK, void*) {
  return ERR_OK;
}
int plc_online_change(void) {
  return 0;
}
RTS_RESULT plc_keep_variables(const char* name, void* address, unsigned int bytes, RTS_UI64) {
  return name != NULL && (address == NULL) == (bytes == 0) ? ERR_OK : ERR_PARAMETER;
}
void plc_apply_forces(void) {}
void plc_log(int level, const char* text) {
  fprintf(stderr, "%d %s\n", level, text);
}

RTS_RESULT plc_declare_variable(const Plc_Variable* variable) {
  struct symbol* next;
  if (variable == NULL || strlen(variable->pszName) > PLC_MAX_SYMBOL_NAME) return ERR_PARAMETER;
  if (variable->pszArea != NULL && strcmp(variable->pszArea, "program") == 0) return ERR_OK;
  if (symbol_count == PLC_MAX_DECLARED_VARIABLES) return ERR_NOMEMORY;
  next = &symbols[symbol_count++];
  next->declared = *variable;
  strcpy(next->name, variable->pszName);
  return ERR_OK;
}

/* All tasks share an area, also one of outputs: they run one after the other. */
RTS_HANDLE plc_declare_area(const Plc_Area* area, RTS_RESULT* result) {
  unsigned int i;
  void* memory;
  if (result != NULL) *result = ERR_NOMEMORY;
  if (area_count == MOST_AREAS - 1) return RTS_INVALID_HANDLE;
  memory = calloc(area->dwBytes, 1);
  if (memory == NULL) return RTS_INVALID_HANDLE;
  if (area->pInitial != NULL) memcpy(memory, area->pInitial, area->dwBytes);
  if (area->ppAddress != NULL) *area->ppAddress = memory;
  for (i = 0; i < area->nUses; ++i)
    if (area->pUses[i].ppAddress != NULL) *area->pUses[i].ppAddress = memory;
  areas[++area_count] = memory;
  if (result != NULL) *result = ERR_OK;
  return (RTS_HANDLE)area_count;
}
void* plc_area_address(RTS_HANDLE handle) {
  return (unsigned long)handle < MOST_AREAS ? areas[(unsigned long)handle] : NULL;
}

/* Of debug builds. Nothing is armed, so no statement calls. */
unsigned int plc_debug_armed;
RTS_RESULT plc_debug_declare_pou(Plc_Pou* pou) {
  return pou != NULL ? ERR_OK : ERR_PARAMETER;
}
RTS_RESULT plc_debug_declare_instance(const Plc_Pou* pou, const void* self, const char* path) {
  return pou != NULL && self != NULL && path != NULL ? ERR_OK : ERR_PARAMETER;
}
void plc_debug_enter(Plc_Frame*) {}
void plc_debug_leave(Plc_Frame*) {}
void plc_debug_statement(Plc_Frame*) {}

/* ---- Calls that only a program of C or C++ makes ----------------------------------------------------------
 */

int plc_start_kind(void) {
  return PLC_START_FIRST;
}
const char* plc_instance_name(void) {
  return "step_application";
}
const char* plc_parameter(const char*) {
  return NULL;
}
RTS_HANDLE SchedGetTaskHandle(const char*, RTS_RESULT* result) {
  if (result != NULL) *result = ERR_NOTINITIALIZED;
  return RTS_INVALID_HANDLE;
}
RTS_HANDLE SchedGetCurrentTask(void) {
  return RTS_INVALID_HANDLE;
}
RTS_HANDLE plc_channel_open(const char*, RTS_RESULT* result) {
  if (result != NULL) *result = ERR_FAILED;
  return RTS_INVALID_HANDLE;
}
unsigned int plc_node_address(const char*) {
  return PLC_NO_NODE;
}

#define REFUSES(function, ...)       \
  RTS_RESULT function(__VA_ARGS__) { \
    return ERR_NOTINITIALIZED;       \
  }
REFUSES(plc_get_area_state, RTS_HANDLE, Plc_Area_State*)
REFUSES(SchedGetTaskInterval, RTS_HANDLE, RTS_I64*)
REFUSES(SchedSetTaskInterval, RTS_HANDLE, RTS_I64)
REFUSES(SchedRaiseEvent, RTS_HANDLE)
REFUSES(SchedReportReferenceTime, RTS_I64, RTS_I64)
REFUSES(SchedGetClockState, RTS_HANDLE, Clock_State*)
REFUSES(SchedUnregisterExternalEvent, RTS_HANDLE)
REFUSES(SchedPostExternalEvent, RTS_HANDLE)
REFUSES(EventUnregisterCallbackFunction, unsigned int, PF_EVENT_CALLBACK, void*)
REFUSES(CAL_SysEventSet, RTS_HANDLE)
REFUSES(plc_channel_send, RTS_HANDLE, unsigned int, int, const void*, unsigned int)
REFUSES(plc_channel_request, RTS_HANDLE, unsigned int, int, const void*, unsigned int, unsigned int*)
REFUSES(plc_channel_reply, RTS_HANDLE, const Block_Info*, const void*, unsigned int)
REFUSES(plc_channel_receive, RTS_HANDLE, void*, unsigned int, Block_Info*)

/* ---- Cycles
 * ------------------------------------------------------------------------------------------------ */

static unsigned int bytes_of(const Plc_Variable* variable) {
  static const unsigned char bytes[] = {0, 1, 1, 2, 4, 8, 1,  2,  4,  8,  1, 2, 4, 8, 4,
                                        8, 8, 8, 8, 8, 0, 16, 16, 16, 16, 0, 0, 8, 1, 2};
  if (variable->dwBytes != 0) return variable->dwBytes;
  return variable->dwType < sizeof bytes ? bytes[variable->dwType] : 0;
}

/* All elements from that dimension on. */
static void print_elements(const Plc_Variable* variable, unsigned int dimension, const unsigned char* at) {
  unsigned int i;
  if (dimension < variable->nDimensions) {
    for (i = 0; i < variable->aDimensions[dimension].nCount; ++i)
      print_elements(variable, dimension + 1, at + (size_t)i * variable->aDimensions[dimension].dwStride);
    return;
  }
  printf(" ");
  for (i = 0; i < bytes_of(variable); ++i) printf("%02x", at[i]);
}

static void print_symbols(long cycle) {
  unsigned int i;
  printf("cycle %ld\n", cycle);
  for (i = 0; i < symbol_count; ++i) {
    printf("%s %u", symbols[i].name, symbols[i].declared.dwType);
    print_elements(&symbols[i].declared, 0, symbols[i].declared.pAddress);
    printf("\n");
  }
}

static void run(Task_Info* task) {
  current = task;
  task->dwTaskEntryFunctionPointer();
  current = NULL;
}

int main(int count, char** arguments) {
  void* const application = count == 4 ? dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL) : NULL;
  const long cycles = count == 4 ? atol(arguments[2]) : 0;
  const long long tick = count == 4 ? atoll(arguments[3]) : 0;
  int (*init)(void) = NULL;
  long cycle;
  int i;
  if (application != NULL) *(void**)&init = dlsym(application, "plc_app_init");
  symbols = calloc(PLC_MAX_DECLARED_VARIABLES, sizeof *symbols);
  if (init == NULL || tick <= 0 || symbols == NULL || init() != 0 || setup == NULL) {
    const char* const why = dlerror();
    fprintf(stderr, "%s\n", why == NULL ? "step_application FILE CYCLES TICK_NS" : why);
    return 2;
  }
  for (cycle = 1; cycle <= cycles; ++cycle) {
    now_ns += tick;
    for (i = 0; i < setup->nTasks; ++i) run(&setup->ptaskinfo[i]);
    print_symbols(cycle);
  }
  return 0;
}
