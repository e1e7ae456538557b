/*
 * An application for plchost of what iec2c has made of a program. The runtime sees only plc_app.h.
 *
 * Located variables have one value each, as the program has pointers to them. At the begin of a task's cycle
 * the variables that it uses are read from the areas; at its end those that it has changed are written back.
 * So a bit and the word around it are the same memory, as IEC 61131-3 says.
 */
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "plc_app.h"
#include "plchost_matiec.h"

PLC_EXPORT_ABI;

struct area {
  char letter;
  const char* name;
  unsigned int flags;
  unsigned int bytes;
  unsigned char* initial;
  Plc_Area_Use* users;
  RTS_HANDLE handle;
};
static struct area areas[] = {{'I', "inputs", PLC_AREA_INPUT, 0, NULL, NULL, NULL},
                              {'Q', "outputs", PLC_AREA_OUTPUT, 0, NULL, NULL, NULL},
                              {'M', "memory", PLC_AREA_MEMORY, 0, NULL, NULL, NULL}};
#define AREAS (sizeof areas / sizeof areas[0])

static Task_Info* infos;

/* The clock of IEC's timers: that of the cycle's begin, for each task its own. */
static struct timespec* now;
struct timespec* plchost_now(void);
struct timespec* plchost_now(void) {
  const Task_Info* const current = plc_current_task();
  return &now[current == NULL ? 0 : current - infos];
}

static struct area* area_of(const struct plchost_place* place) {
  unsigned int i = 0;
  while (areas[i].letter != place->area) ++i;
  return &areas[i];
}

static unsigned long long value_of(const struct plchost_place* place) {
  unsigned long long value = 0;
  memcpy(&value, place->value, place->bytes);
  return place->bit < 0 ? value : value != 0;
}

static unsigned long long load(const struct plchost_place* place, const unsigned char* area) {
  unsigned long long value = 0;
  memcpy(&value, area + place->offset, place->bytes);
  return place->bit < 0 ? value : (value >> place->bit) & 1u;
}

/* Tasks that can pre-empt each other may have bits in one byte of the memory area. */
static void store(const struct plchost_place* place, unsigned char* area, unsigned long long value) {
  unsigned char* const byte = area + place->offset;
  if (place->bit < 0) {
    memcpy(byte, &value, place->bytes);
  } else if (value != 0) {
    __atomic_fetch_or(byte, (unsigned char)(1u << place->bit), __ATOMIC_RELAXED);
  } else {
    __atomic_fetch_and(byte, (unsigned char)~(1u << place->bit), __ATOMIC_RELAXED);
  }
}

/* Where they are for the task whose cycle runs on this thread. */
static void find_areas(unsigned char* found[AREAS]) {
  unsigned int i;
  for (i = 0; i < AREAS; ++i) found[i] = areas[i].bytes == 0 ? NULL : plc_area_address(areas[i].handle);
}

void plchost_begin(unsigned int number) {
  const struct plchost_task* const task = &plchost_tasks[number];
  unsigned char* found[AREAS];
  unsigned int i;
  clock_gettime(CLOCK_MONOTONIC, &now[number]);
  find_areas(found);
  for (i = 0; i < task->uses_count; ++i) {
    const struct plchost_place* const place = &plchost_places[task->uses[i]];
    task->at_begin[i] = load(place, found[area_of(place) - areas]);
    memcpy(place->value, &task->at_begin[i], place->bytes);
  }
}

void plchost_end(unsigned int number) {
  const struct plchost_task* const task = &plchost_tasks[number];
  unsigned char* found[AREAS];
  unsigned int i;
  find_areas(found);
  for (i = 0; i < task->uses_count; ++i) {
    const struct plchost_place* const place = &plchost_places[task->uses[i]];
    const unsigned long long value = value_of(place);
    if (place->area == 'I' || value == task->at_begin[i]) continue;
    store(place, found[area_of(place) - areas], value);
  }
}

static int uses(const struct plchost_task* task, const struct area* area) {
  unsigned int i;
  for (i = 0; i < task->uses_count; ++i) {
    if (area_of(&plchost_places[task->uses[i]]) == area) return 1;
  }
  return 0;
}

static int use_area(struct area* area) {
  unsigned int i;
  Plc_Area declared;
  for (i = 0; i < plchost_place_count; ++i) {
    const struct plchost_place* const place = &plchost_places[i];
    const unsigned int end = place->offset + place->bytes;
    if (place->area == area->letter && end > area->bytes) area->bytes = end;
  }
  if (area->bytes == 0) return 1;
  area->initial = calloc(area->bytes, 1);
  if (area->initial == NULL) return 0;
  for (i = 0; i < plchost_place_count; ++i) {
    const struct plchost_place* const place = &plchost_places[i];
    if (place->area == area->letter) store(place, area->initial, value_of(place));
  }
  memset(&declared, 0, sizeof declared);
  declared.dwSize = sizeof declared;
  declared.dwFlags = area->flags;
  declared.pszName = area->name;
  declared.dwBytes = area->bytes;
  declared.pInitial = area->initial;
  area->users = calloc(plchost_task_count, sizeof *area->users);
  if (area->users == NULL) return 0;
  for (i = 0; i < plchost_task_count; ++i) {
    if (uses(&plchost_tasks[i], area)) area->users[declared.nUses++].pszTask = plchost_tasks[i].name;
  }
  /* A variable that no program names has an area of all tasks. */
  declared.pUses = area->users;
  area->handle = plc_declare_area(&declared, NULL);
  return area->handle != RTS_INVALID_HANDLE;
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
  now = calloc(plchost_task_count, sizeof *now);
  if (infos == NULL || now == NULL) return 1;
  config_init__();
  for (i = 0; i < AREAS; ++i) {
    if (!use_area(&areas[i])) return 1;
  }
  for (i = 0; i < plchost_task_count; ++i) fill(&infos[i], &plchost_tasks[i]);
  setup.nTasks = (short)plchost_task_count;
  strncpy(setup.stApplicationName, plchost_application_name, sizeof setup.stApplicationName - 1);
  setup.ptaskinfo = infos;
  __sys__setup__tasks(&setup);
  for (i = 0; i < plchost_task_count; ++i) {
    if (!set_options(&plchost_tasks[i]) || !register_event(&plchost_tasks[i])) return 1;
  }
  return 0;
}

void CDECL plc_app_exit(void) {
  unsigned int i;
  for (i = 0; i < AREAS; ++i) {
    free(areas[i].initial);
    free(areas[i].users);
  }
  free(infos);
  free(now);
}
