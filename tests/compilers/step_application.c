/*
 * Runs the tasks of an application cycle by cycle, by a clock of its own, and prints its variables after each
 * cycle: step_application FILE CYCLES TICK_NS. It has those functions of plc_app.h that the adapters call. So
 * values of two compilers are compared where no instance would stop between two cycles.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "plc_online_change.h"

#define MOST_VARIABLES 65536
#define MOST_AREAS 64

struct variable {
  char name[PLC_MAX_VARIABLE_NAME + 1];
  const unsigned char* value;
  unsigned int bytes;
};
static struct variable variables[MOST_VARIABLES];
static unsigned int variable_count;
static void* areas[MOST_AREAS];
static unsigned long area_count;
static sys_setup_tasks_struct* setup;
static Task_Info* current;
static long long now_ns;

/* The adapters' clock. */
int clock_gettime(clockid_t clock, struct timespec* time) {
  (void)clock;
  time->tv_sec = now_ns / 1000000000;
  time->tv_nsec = now_ns % 1000000000;
  return 0;
}

void __sys__setup__tasks(sys_setup_tasks_struct* given) {
  setup = given;
}
RTS_RESULT plc_set_task_options(const char* task, const Task_Options* options) {
  return task != NULL && options != NULL ? ERR_OK : ERR_PARAMETER;
}
RTS_RESULT plc_prefer_scheduler(const char* name) {
  return name != NULL ? ERR_OK : ERR_PARAMETER;
}
Task_Info* plc_current_task(void) {
  return current;
}
RTS_HANDLE SchedRegisterExternalEvent(const char* name, RTS_RESULT* result) {
  if (result != NULL) *result = ERR_OK;
  return (RTS_HANDLE)name;
}
RTS_RESULT EventRegisterCallbackFunction(unsigned int event, PF_EVENT_CALLBACK callback, void* user) {
  (void)event;
  (void)callback;
  (void)user;
  return ERR_OK;
}
int plc_online_change(void) {
  return 0;
}
void plc_log(int level, const char* text) {
  fprintf(stderr, "%d %s\n", level, text);
}
RTS_RESULT plc_keep_variables(const char* name, void* address, unsigned int bytes, RTS_UI64 layout) {
  struct variable* const next = &variables[variable_count];
  (void)layout;
  if (variable_count == MOST_VARIABLES || strlen(name) > PLC_MAX_VARIABLE_NAME) return ERR_NOMEMORY;
  strcpy(next->name, name);
  next->value = address;
  next->bytes = bytes;
  ++variable_count;
  return ERR_OK;
}
RTS_HANDLE plc_declare_area(const Plc_Area* area, RTS_RESULT* result) {
  if (result != NULL) *result = ERR_OK;
  if (area_count == MOST_AREAS - 1) return RTS_INVALID_HANDLE;
  areas[++area_count] = calloc(area->dwBytes, 1);
  if (area->pInitial != NULL) memcpy(areas[area_count], area->pInitial, area->dwBytes);
  return (RTS_HANDLE)area_count;
}
void* plc_area_address(RTS_HANDLE handle) {
  return areas[(unsigned long)handle];
}

static void print_variables(long cycle) {
  unsigned int i;
  unsigned int j;
  printf("cycle %ld\n", cycle);
  for (i = 0; i < variable_count; ++i) {
    printf("%s ", variables[i].name);
    for (j = 0; j < variables[i].bytes; ++j) printf("%02x", variables[i].value[j]);
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
  int (*const init)(void) = application == NULL ? NULL : (int (*)(void))dlsym(application, "plc_app_init");
  const long cycles = count == 4 ? atol(arguments[2]) : 0;
  const long long tick = count == 4 ? atoll(arguments[3]) : 0;
  long cycle;
  int i;
  if (init == NULL || tick <= 0 || init() != 0 || setup == NULL) {
    const char* const why = dlerror();
    fprintf(stderr, "%s\n", why == NULL ? "step_application FILE CYCLES TICK_NS" : why);
    return 2;
  }
  for (cycle = 1; cycle <= cycles; ++cycle) {
    now_ns += tick;
    for (i = 0; i < setup->nTasks; ++i) run(&setup->ptaskinfo[i]);
    print_variables(cycle);
  }
  return 0;
}
