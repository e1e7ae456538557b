/*
 * Located variables and their areas. A variable has one value. All tasks share it as they share globals.
 *
 * Inputs: a task takes them from its copy of the area at the begin of its cycle. A variable of a program has
 * a value for each task.
 *
 * Outputs: the value is the truth. A task puts its places out at the end of its cycle. With them it puts the
 * other bits of their bytes, as the tasks that use those have put them last. Places that share bits are taken
 * at the begin, and put out if they changed.
 *
 * Memory: others write it, too. A place is taken if it differs from the value that was exchanged last, and
 * the program's value does not. It is put out if the program's value does: by a task that has changed it, or
 * by the last one that uses it. So neither a task that interrupts this one nor firmware is undone. If both
 * have changed it in one cycle, the program's value holds.
 */
#include <stdlib.h>
#include <string.h>

#include "plc_app.h"
#include "plchost_adapter.h"

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

static struct area* area_of(const struct plchost_place* place) {
  unsigned int i = 0;
  while (areas[i].letter != place->area) ++i;
  return &areas[i];
}

/* Values lie at multiples of their size, places do not. A task that sees what another one has written sees
 * all that this one has done before. */
static unsigned long long value_at(const void* value, unsigned int bytes) {
  switch (bytes) {
    case 1:
      return __atomic_load_n((const unsigned char*)value, __ATOMIC_ACQUIRE);
    case 2:
      return __atomic_load_n((const unsigned short*)value, __ATOMIC_ACQUIRE);
    case 4:
      return __atomic_load_n((const unsigned int*)value, __ATOMIC_ACQUIRE);
    default:
      return __atomic_load_n((const unsigned long long*)value, __ATOMIC_ACQUIRE);
  }
}
static unsigned long long value_of(const struct plchost_place* place, const void* value) {
  const unsigned long long now = value_at(value, place->bytes);
  return place->bit < 0 ? now : now != 0;
}
static void set_value(void* value, unsigned int bytes, unsigned long long now) {
  switch (bytes) {
    case 1:
      __atomic_store_n((unsigned char*)value, (unsigned char)now, __ATOMIC_RELEASE);
      break;
    case 2:
      __atomic_store_n((unsigned short*)value, (unsigned short)now, __ATOMIC_RELEASE);
      break;
    case 4:
      __atomic_store_n((unsigned int*)value, (unsigned int)now, __ATOMIC_RELEASE);
      break;
    default:
      __atomic_store_n((unsigned long long*)value, now, __ATOMIC_RELEASE);
  }
}
/* Unless another task has changed it meanwhile: then 0. */
#define SET_IF(type)                                                                            \
  {                                                                                             \
    type expected = (type)before;                                                               \
    return __atomic_compare_exchange_n((type*)value, &expected, (type)now, 0, __ATOMIC_SEQ_CST, \
                                       __ATOMIC_SEQ_CST);                                       \
  }
static int set_value_if(void* value, unsigned int bytes, unsigned long long before, unsigned long long now) {
  switch (bytes) {
    case 1:
      SET_IF(unsigned char)
    case 2:
      SET_IF(unsigned short)
    case 4:
      SET_IF(unsigned int)
    default:
      SET_IF(unsigned long long)
  }
}

/* Others write and read the memory area meanwhile: of such a value they, and this task, see no half. */
static int is_whole(const struct plchost_place* place, const unsigned char* area) {
  return (unsigned long)(area + place->offset) % place->bytes == 0;
}

static unsigned long long load(const struct plchost_place* place, const unsigned char* area) {
  unsigned long long value = 0;
  if (is_whole(place, area))
    value = value_at(area + place->offset, place->bytes);
  else
    memcpy(&value, area + place->offset, place->bytes);
  return place->bit < 0 ? value : (value >> place->bit) & 1u;
}

/* Several tasks may have bits in one byte of the memory area. */
static void store(const struct plchost_place* place, unsigned char* area, unsigned long long value) {
  unsigned char* const byte = area + place->offset;
  if (place->bit < 0 && is_whole(place, area)) {
    set_value(byte, place->bytes, value);
  } else if (place->bit < 0) {
    memcpy(byte, &value, place->bytes);
  } else if (value != 0) {
    __atomic_fetch_or(byte, (unsigned char)(1u << place->bit), __ATOMIC_ACQ_REL);
  } else {
    __atomic_fetch_and(byte, (unsigned char)~(1u << place->bit), __ATOMIC_ACQ_REL);
  }
}

/* Where they are for the task whose cycle runs on this thread. */
static void find_areas(unsigned char* found[AREAS]) {
  unsigned int i;
  for (i = 0; i < AREAS; ++i) found[i] = areas[i].bytes == 0 ? NULL : plc_area_address(areas[i].handle);
}

/* Unless a task that came between has exchanged another one: then 0. */
static int exchange(unsigned int number, unsigned long long last, unsigned long long now) {
  return __atomic_compare_exchange_n(&plchost_exchanged[number], &last, now, 0, __ATOMIC_SEQ_CST,
                                     __ATOMIC_SEQ_CST);
}
static unsigned long long exchanged(unsigned int number) {
  return __atomic_load_n(&plchost_exchanged[number], __ATOMIC_SEQ_CST);
}

/* The phases of a task. It takes, and puts, the places one after the other. */
enum { OUTSIDE = 0, TAKES = 1, IN_CYCLE = 2, PUTS = 4 };
static unsigned char* phases = NULL; /* of each task */
static unsigned char* left = NULL;   /* for each place: cycles whose tasks have left it to another one */
#define MOST_LEFT 200                /* that one may have been stopped in its cycle, by a fault */

static void set_phase(const struct plchost_task* task, unsigned char phase) {
  __atomic_store_n(&phases[task - plchost_tasks], phase, __ATOMIC_SEQ_CST);
}

static int another_is_in(int any_of, const struct plchost_task* task, unsigned int place) {
  unsigned int i;
  unsigned int j;
  for (i = 0; i < plchost_task_count; ++i) {
    const struct plchost_task* const other = &plchost_tasks[i];
    if (other == task || (__atomic_load_n(&phases[i], __ATOMIC_SEQ_CST) & any_of) == 0) continue;
    for (j = 0; j < other->uses_count; ++j) {
      if (other->uses[j].place == place) return 1;
    }
  }
  return 0;
}

static int leaves(const struct plchost_task* task, unsigned int place, int any_of) {
  if (!another_is_in(any_of, task, place)) return 0;
  return __atomic_add_fetch(&left[place], 1, __ATOMIC_RELAXED) <= MOST_LEFT;
}

/* If the program's value is not the one that was exchanged last, a task has assigned it and not put it yet.
 * While another task puts, the value in the area may be older than the program's. The new value counts as
 * exchanged before the program has it: then a task that comes between knows the old one for unchanged. */
static void take_memory(const struct plchost_task* task, struct plchost_use* use, const unsigned char* area) {
  const struct plchost_place* const place = &plchost_places[use->place];
  const unsigned long long last = exchanged(use->place);
  const unsigned long long before = value_at(place->value, place->bytes);
  const unsigned long long now = load(place, area);
  if (now != last && value_of(place, &before) == last && !leaves(task, use->place, PUTS)) {
    set_phase(task, TAKES);
    __atomic_store_n(&left[use->place], 0, __ATOMIC_RELAXED);
    if (exchange(use->place, last, now)) set_value_if(place->value, place->bytes, before, now);
    set_phase(task, IN_CYCLE);
  }
  use->before = value_of(place, place->value);
}

/* A value that this task has not changed is that of another one, which may be in the midst of its cycle, or
 * of an operator. While another task takes, the program may still have the value of before. If another task
 * puts between the store and the exchange, its value is newer, and the one in the area is replaced again. */
static void put_memory(const struct plchost_task* task, const struct plchost_use* use, unsigned char* area) {
  const struct plchost_place* const place = &plchost_places[use->place];
  int is_old = 0; /* the value in the area */
  for (;;) {
    const unsigned long long last = exchanged(use->place);
    const unsigned long long value = value_of(place, place->value);
    const int others = value == use->before ? TAKES | IN_CYCLE : TAKES;
    if (!is_old && (value == last || leaves(task, use->place, others))) return;
    if (exchanged(use->place) != last || value_of(place, place->value) != value) continue;
    __atomic_store_n(&left[use->place], 0, __ATOMIC_RELAXED);
    store(place, area, value);
    is_old = !exchange(use->place, last, value);
  }
}

/* An online change: this program takes over from one that runs. */
static int takes_over = 0;

/* Of another version, whose values this one has: then they are those that were exchanged last. */
static void find_exchanged(void) {
  unsigned int i;
  for (i = 0; i < plchost_place_count; ++i) {
    const struct plchost_place* const place = &plchost_places[i];
    if (place->area == 'Q' || (place->area == 'M' && takes_over))
      plchost_exchanged[i] = value_of(place, place->value);
  }
}

static void put_output(const struct plchost_use* use, unsigned char* area) {
  const struct plchost_place* const place = &plchost_places[use->place];
  unsigned long long* const exchanged = &plchost_exchanged[use->place];
  const unsigned long long value = value_of(place, use->value);
  if (use->others) {
    store(place, area, __atomic_load_n(exchanged, __ATOMIC_SEQ_CST));
  } else if (!place->aliased || value != use->before) {
    __atomic_store_n(exchanged, value, __ATOMIC_SEQ_CST);
    store(place, area, value);
  }
}

void plchost_take_places(const struct plchost_task* task) {
  static int is_known = 0;
  unsigned char* found[AREAS];
  unsigned int i;
  if (!__atomic_load_n(&is_known, __ATOMIC_SEQ_CST)) {
    find_exchanged();
    __atomic_store_n(&is_known, 1, __ATOMIC_SEQ_CST);
  }
  set_phase(task, IN_CYCLE);
  find_areas(found);
  for (i = 0; i < task->uses_count; ++i) {
    struct plchost_use* const use = &task->uses[i];
    const struct plchost_place* const place = &plchost_places[use->place];
    const unsigned char* const area = found[area_of(place) - areas];
    if (place->area == 'M') {
      take_memory(task, use, area);
    } else if (place->area == 'I' || place->aliased) {
      use->before = load(place, area);
      set_value(use->value, place->bytes, use->before);
    }
  }
}

void plchost_put_places(const struct plchost_task* task) {
  unsigned char* found[AREAS];
  unsigned int i;
  set_phase(task, PUTS);
  find_areas(found);
  for (i = 0; i < task->uses_count; ++i) {
    const struct plchost_use* const use = &task->uses[i];
    const struct plchost_place* const place = &plchost_places[use->place];
    unsigned char* const area = found[area_of(place) - areas];
    if (place->area == 'M') {
      put_memory(task, use, area);
    } else if (place->area == 'Q') {
      put_output(use, area);
    }
  }
  set_phase(task, OUTSIDE);
}

void plchost_exchange_places(const struct plchost_task* task) {
  unsigned char* found[AREAS];
  unsigned int step;
  unsigned int i;
  find_areas(found);
  for (step = 0; step < 2; ++step) { /* all of them are put before any is taken */
    set_phase(task, step == 0 ? PUTS : IN_CYCLE);
    for (i = 0; i < task->uses_count; ++i) {
      struct plchost_use* const use = &task->uses[i];
      const struct plchost_place* const place = &plchost_places[use->place];
      unsigned char* const area = found[area_of(place) - areas];
      if (!place->aliased || place->area == 'I') continue;
      if (place->area == 'M') {
        if (step == 0)
          put_memory(task, use, area);
        else
          take_memory(task, use, area);
      } else if (step == 0) {
        put_output(use, area);
      } else {
        use->before = load(place, area);
        set_value(use->value, place->bytes, use->before);
      }
    }
  }
}

unsigned char plchost_bit_now(unsigned int number) {
  const struct plchost_place* const place = &plchost_places[number];
  const unsigned char* const area = plc_area_address(area_of(place)->handle);
  return area == NULL ? 0 : (unsigned char)load(place, area);
}

static int uses(const struct plchost_task* task, const struct area* area) {
  unsigned int i;
  for (i = 0; i < task->uses_count; ++i) {
    if (area_of(&plchost_places[task->uses[i].place]) == area) return 1;
  }
  return 0;
}

/* Places may share bytes, and a bit that is set in one of them is set. */
static void preset(const struct area* area) {
  unsigned int i;
  unsigned int j;
  for (i = 0; i < plchost_place_count; ++i) {
    const struct plchost_place* const place = &plchost_places[i];
    const unsigned long long value = value_of(place, place->value);
    if (place->area != area->letter) continue;
    if (place->bit >= 0) {
      area->initial[place->offset] |= (unsigned char)(value << place->bit);
      continue;
    }
    for (j = 0; j < place->bytes; ++j) area->initial[place->offset + j] |= (unsigned char)(value >> (8 * j));
  }
}

/* Of all areas together. */
static unsigned char* initial_bytes = NULL;
static Plc_Area_Use* area_users = NULL;

static int allocate_areas(void) {
  unsigned int i;
  unsigned int bytes = 0;
  for (i = 0; i < plchost_place_count; ++i) {
    const struct plchost_place* const place = &plchost_places[i];
    struct area* const area = area_of(place);
    const unsigned int end = place->offset + place->bytes;
    if (end > area->bytes) area->bytes = end;
  }
  for (i = 0; i < AREAS; ++i) bytes += areas[i].bytes;
  phases = calloc(plchost_task_count + 1u, 1);
  left = calloc(plchost_place_count + 1u, 1);
  if (phases == NULL || left == NULL) return 0;
  if (bytes == 0) return 1;
  initial_bytes = calloc(bytes, 1);
  area_users = calloc(AREAS * plchost_task_count, sizeof *area_users);
  if (initial_bytes == NULL || area_users == NULL) return 0;
  bytes = 0;
  for (i = 0; i < AREAS; ++i) {
    areas[i].initial = initial_bytes + bytes;
    areas[i].users = area_users + i * plchost_task_count;
    bytes += areas[i].bytes;
  }
  return 1;
}

static int declare(struct area* area) {
  unsigned int i;
  Plc_Area declared;
  if (area->bytes == 0) return 1;
  preset(area);
  memset(&declared, 0, sizeof declared);
  declared.dwSize = sizeof declared;
  declared.dwFlags = area->flags;
  declared.pszName = area->name;
  declared.dwBytes = area->bytes;
  declared.pInitial = area->initial;
  for (i = 0; i < plchost_task_count; ++i) {
    if (uses(&plchost_tasks[i], area)) area->users[declared.nUses++].pszTask = plchost_tasks[i].name;
  }
  /* A variable that no program names has an area of all tasks. */
  declared.pUses = area->users;
  area->handle = plc_declare_area(&declared, NULL);
  return area->handle != RTS_INVALID_HANDLE;
}

int plchost_declare_places(void) {
  unsigned int i;
  takes_over = plc_online_change();
  for (i = 0; i < plchost_place_count; ++i) {
    const struct plchost_place* const place = &plchost_places[i];
    plchost_exchanged[i] = value_of(place, place->value);
    /* An output is what the program has; an edge is one of a value of before. */
    if (plc_keep_variables(place->name, place->value, place->bytes, 0) != ERR_OK) return 0;
  }
  for (i = 0; i < plchost_location_count; ++i) {
    const struct plchost_location* const location = &plchost_locations[i];
    if (plc_keep_variables(location->name, NULL, 0, location->layout) != ERR_OK) return 0;
  }
  if (!allocate_areas()) return 0;
  for (i = 0; i < AREAS; ++i) {
    if (!declare(&areas[i])) return 0;
  }
  return 1;
}

void plchost_forget_places(void) {
  free(initial_bytes);
  free(area_users);
  free(phases);
  free(left);
}
