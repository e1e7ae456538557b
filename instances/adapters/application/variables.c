/*
 * The variables of the program that are not located. All of them go on in an online change. Those with RETAIN
 * have a copy in an area of that kind. They are read from it before the first task starts. Each task puts
 * there those that it may have changed, at the end of its cycles.
 */
#include <stdlib.h>
#include <string.h>

#include "plc_app.h"
#include "plchost_adapter.h"

struct retained {
  unsigned char* value;
  unsigned int bytes;
  unsigned int offset; /* in the area */
};
static struct retained* retained;
static unsigned int retained_count;
static unsigned int retained_bytes;
static const struct retained** by_address;
static unsigned long long retained_layout = 0xcbf29ce484222325ull;
static unsigned char* initial;
static Plc_Area_Use* users;
static RTS_HANDLE area;

static unsigned long long all_bytes;
static unsigned int all_count;
static RTS_RESULT naming;

static void hash(const void* bytes, unsigned int count) {
  const unsigned char* const byte = bytes;
  unsigned int i;
  for (i = 0; i < count; ++i) retained_layout = (retained_layout ^ byte[i]) * 0x100000001b3ull;
}

static void measure(const struct plchost_variable* variable) {
  if (variable->bytes == 0) return; /* a chart without actions */
  all_bytes += variable->bytes;
  ++all_count;
  if (!variable->retain) return;
  ++retained_count;
  retained_bytes += (variable->bytes + 7u) & ~7u;
  hash(variable->path, (unsigned int)strlen(variable->path) + 1);
  hash(&variable->layout, sizeof variable->layout);
  hash(&variable->bytes, sizeof variable->bytes);
}

static void name(const struct plchost_variable* variable) {
  const RTS_RESULT result = variable->bytes == 0 ? ERR_OK
                                                 : plc_keep_variables(variable->path, variable->value,
                                                                      variable->bytes, variable->layout);
  if (result != ERR_OK) naming = result;
}

static void lay_out(const struct plchost_variable* variable) {
  struct retained* const next = &retained[retained_count];
  if (!variable->retain) return;
  next->value = variable->value;
  next->bytes = variable->bytes;
  next->offset = retained_bytes;
  memcpy(initial + next->offset, next->value, next->bytes);
  retained_bytes += (next->bytes + 7u) & ~7u;
  ++retained_count;
}

static int compare_addresses(const void* left, const void* right) {
  const unsigned char* const one = (*(const struct retained* const*)left)->value;
  const unsigned char* const other = (*(const struct retained* const*)right)->value;
  return (one > other) - (one < other);
}

int plchost_is_retained(const void* value) {
  const unsigned char* const byte = value;
  unsigned int first = 0;
  unsigned int end = retained_count; /* the first one that lies behind */
  while (first < end) {
    const unsigned int middle = first + (end - first) / 2;
    if (by_address[middle]->value <= byte)
      first = middle + 1;
    else
      end = middle;
  }
  return end > 0 && byte < by_address[end - 1]->value + by_address[end - 1]->bytes;
}

/* On the control thread, before any task runs. */
static void CDECL restore(unsigned int event, const EVTPARAM_ExternalEventTask* parameter, void* user) {
  const unsigned char* const kept = plc_area_address(area);
  unsigned int i;
  (void)event;
  (void)parameter;
  (void)user;
  if (kept == NULL) return;
  for (i = 0; i < retained_count; ++i) {
    memcpy(retained[i].value, kept + retained[i].offset, retained[i].bytes);
  }
}

static int declare_area(void) {
  Plc_Area declared;
  unsigned int i;
  if (retained_count == 0) return 1;
  retained = calloc(retained_count, sizeof *retained);
  initial = calloc(retained_bytes, 1);
  users = calloc(plchost_task_count, sizeof *users);
  by_address = calloc(retained_count, sizeof(const struct retained*));
  if (retained == NULL || initial == NULL || users == NULL || by_address == NULL) return 0;
  memset(&declared, 0, sizeof declared);
  declared.dwSize = sizeof declared;
  declared.dwFlags = PLC_AREA_RETAIN;
  declared.pszName = "retain";
  declared.dwBytes = retained_bytes;
  declared.pInitial = initial;
  declared.qwLayout = retained_layout;
  retained_count = 0;
  retained_bytes = 0;
  plchost_each_variable(lay_out);
  for (i = 0; i < retained_count; ++i) by_address[i] = &retained[i];
  qsort(by_address, retained_count, sizeof(const struct retained*), compare_addresses);
  for (i = 0; i < plchost_task_count; ++i) {
    if (plchost_tasks[i].retained_count > 0) users[declared.nUses++].pszTask = plchost_tasks[i].name;
  }
  declared.pUses = users;
  area = plc_declare_area(&declared, NULL);
  return area != RTS_INVALID_HANDLE &&
         EventRegisterCallbackFunction(EVT_PrepareStart, restore, NULL) == ERR_OK;
}

int plchost_declare_variables(void) {
  plchost_each_variable(measure);
  if (all_count > PLC_MAX_VARIABLES || all_bytes > PLC_MAX_VARIABLE_BYTES) {
    /* Some of them would go on, and others not. */
    if (!plc_online_change()) return declare_area();
    plc_log(PLC_LOG_ERROR, "the variables of this program are more than an online change carries over");
    return 0;
  }
  plchost_each_variable(name);
  return naming == ERR_OK && declare_area();
}

void plchost_keep_retained(const struct plchost_task* task) {
  unsigned char* const kept = task->retained_count == 0 ? NULL : plc_area_address(area);
  unsigned int i;
  if (kept == NULL) return;
  for (i = 0; i < task->retained_count; ++i) {
    const struct retained* const one = &retained[task->retained[i]];
    if (memcmp(kept + one->offset, one->value, one->bytes) != 0)
      memcpy(kept + one->offset, one->value, one->bytes);
  }
}

void plchost_forget_variables(void) {
  free(by_address);
  free(retained);
  free(initial);
  free(users);
}
