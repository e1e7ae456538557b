/*
 * An application for plchost of what a compiler has made of a program. The runtime sees only plc_app.h.
 */
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "plc_app.h"
#include "plc_variables.h"
#include "plchost_adapter.h"

PLC_EXPORT_ABI;

/* Of a debug build; null: it is none. Returns 0 if that fails. */
__attribute__((weak, visibility("hidden"))) int plchost_declare_debugging(void);

static Task_Info* infos;

/* For each task its own. */
struct task_clock {
  struct timespec now; /* of IEC's timers: that of the cycle's begin */
  unsigned long long first_ns;
  unsigned long ticks;
};
static struct task_clock* clocks;
static struct task_clock* current_clock(void) {
  const Task_Info* const current = plc_current_task();
  return &clocks[current == NULL ? 0 : current - infos];
}

/* Which the library of a compiler declares in its own way. */
struct timespec* plchost_now(void);
struct timespec* plchost_now(void) {
  return &current_clock()->now;
}
unsigned long* plchost_ticks(unsigned long long tick_ns);
unsigned long* plchost_ticks(unsigned long long tick_ns) {
  struct task_clock* const own = current_clock();
  const unsigned long long ns =
      (unsigned long long)own->now.tv_sec * 1000000000ull + (unsigned long long)own->now.tv_nsec;
  if (own->first_ns == 0) own->first_ns = ns;
  /* Rounded from the first cycle on: one that begins a little early or late skips and repeats no tick. */
  own->ticks = (unsigned long)(own->first_ns / tick_ns + (ns - own->first_ns + tick_ns / 2) / tick_ns);
  return &own->ticks;
}

int plchost_is_stopped(unsigned int number) {
  return __atomic_load_n(&infos[number].tLastCycleTime, __ATOMIC_ACQUIRE) < 0;
}

int plchost_assign(void* value, const void* now) {
  const Task_Info* const current = plc_current_task();
  return current != NULL && plchost_assign_place(&plchost_tasks[current - infos], value, now);
}

/* Places that share bits with a forced one have its bits. One of them may be forced, too. */
static void apply_forces(const struct plchost_task* task) {
  plc_apply_forces();
  if (plchost_settle_forced_places(task)) plc_apply_forces();
}

void plchost_begin(unsigned int number) {
  clock_gettime(CLOCK_MONOTONIC, &clocks[number].now);
  plchost_take_places(&plchost_tasks[number]);
  apply_forces(&plchost_tasks[number]);
}

void plchost_end(unsigned int number) {
  plchost_settle_places(&plchost_tasks[number]);
  apply_forces(&plchost_tasks[number]);
  plchost_put_places(&plchost_tasks[number]);
  plchost_keep_retained(&plchost_tasks[number]);
}

static void fill(Task_Info* info, const struct plchost_task* task) {
  strncpy(info->stName, task->name, sizeof info->stName - 1);
  info->nPriority = task->priority;
  info->dwTaskEntryFunctionPointer = task->run;
  if (task->external_event != NULL) {
    info->KindOfTask = External;
    strncpy(info->stExternalEvent, task->external_event, sizeof info->stExternalEvent - 1);
  } else if (task->edge != NULL) {
    info->KindOfTask = Event;
    info->dwEventFunctionPointer = task->edge;
  } else if (task->interval_ns == 0) {
    info->KindOfTask = Freewheeling;
  } else {
    info->KindOfTask = Cyclic;
    info->bMicroseconds = task->interval_ns % 1000000 != 0;
    info->dwInterval = (unsigned int)(task->interval_ns / (info->bMicroseconds ? 1000 : 1000000));
  }
}

/* The log says what the runtime refuses. */
static int set_options(const struct plchost_task* task) {
  const struct plchost_options* const given = task->options;
  Task_Options options;
  if (given == NULL) return 1;
  memset(&options, 0, sizeof options);
  options.dwSize = sizeof options;
  options.nStartOffsetNs = given->start_offset_ns;
  options.nLatePolicy = given->late_policy;
  options.bDrivesOutputs = given->drives_outputs;
  options.dwWatchdogTimeUs = given->watchdog_time_us;
  options.dwWatchdogSensitivity = given->watchdog_sensitivity;
  options.dwWatchdogOmittedCycles = given->watchdog_omitted_cycles;
  options.nWatchdogPolicy = given->watchdog_policy;
  return plc_set_task_options(task->name, &options) == ERR_OK;
}

/* Several tasks may wait for one event. */
static int register_event(const struct plchost_task* task) {
  return task->external_event == NULL ||
         SchedRegisterExternalEvent(task->external_event, NULL) != RTS_INVALID_HANDLE;
}

int CDECL plc_app_init(void) {
  static sys_setup_tasks_struct setup;
  unsigned int i;
  infos = calloc(plchost_task_count, sizeof *infos);
  clocks = calloc(plchost_task_count, sizeof *clocks);
  if (infos == NULL || clocks == NULL || !plchost_prepare_copies()) return 1;
  plchost_bind();
  if (!plchost_declare_places() || !plchost_declare_variables() || !plchost_declare_symbols()) return 1;
  if (plchost_declare_debugging != NULL && !plchost_declare_debugging()) return 1;
  for (i = 0; i < plchost_task_count; ++i) fill(&infos[i], &plchost_tasks[i]);
  setup.nTasks = (short)plchost_task_count;
  strncpy(setup.stApplicationName, plchost_application_name, sizeof setup.stApplicationName - 1);
  setup.ptaskinfo = infos;
  __sys__setup__tasks(&setup);
  if (plchost_scheduler[0] != 0 && plc_prefer_scheduler(plchost_scheduler) != ERR_OK) return 1;
  for (i = 0; i < plchost_task_count; ++i) {
    if (!set_options(&plchost_tasks[i]) || !register_event(&plchost_tasks[i])) return 1;
  }
  return 0;
}

void CDECL plc_app_exit(void) {
  plchost_forget_copies();
  plchost_forget_places();
  plchost_forget_variables();
  free(infos);
  free(clocks);
}
