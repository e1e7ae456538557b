/*
 * Located variables and their areas. A variable has one value. All tasks share it as they share globals.
 *
 * Inputs: a task takes them from its copy of the area at the begin of its cycle. A variable of a program has
 * a value for each task.
 *
 * Outputs: the value is the truth. A task puts its places out at the end of its cycle. With them it puts the
 * other bits of their bytes, as the tasks that use those have put them last.
 *
 * Memory: others write it, too. A place is taken if it differs from the value that was exchanged last, and
 * the program's value does not. It is put out if the program's value does: by a task that has changed it, or
 * by the last one that uses it. So neither a task that interrupts this one nor firmware is undone. If both
 * have changed it in one cycle, the program's value holds. Of places that share bits, this is true of each
 * bit by itself.
 *
 * Outputs and memory whose places share bits: each has a value. Within a task they are one memory, as a value
 * that one of them is assigned is passed on to the others, in the order of the statements. Other changes, by
 * an operator, a force or a reference, are passed on when the places are settled: the narrow ones last.
 */
#include <stdlib.h>
#include <string.h>

#include "place_values.h"
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

/* Of a place that shares bits, others may have those that are not in `bits`. */
static void store_bits(const struct plchost_place* place, unsigned char* area, unsigned long long value,
                       unsigned long long bits) {
  const unsigned int piece = is_whole(place, area) ? place->bytes : 1;
  unsigned int i;
  if (place->bit >= 0 || bits == ALL_BITS) {
    store(place, area, value);
    return;
  }
  for (i = 0; i < place->bytes; i += piece) {
    unsigned char* const at = area + place->offset + i;
    const unsigned long long mask = bits >> (8 * i);
    unsigned long long before;
    do {
      before = value_at(at, piece);
    } while (!set_value_if(at, piece, before, (before & ~mask) | ((value >> (8 * i)) & mask)));
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

static void set_phase(const struct plchost_task* task, unsigned char phase) {
  __atomic_store_n(&phases[task - plchost_tasks], phase, __ATOMIC_SEQ_CST);
}

static int another_is_in(int any_of, const struct plchost_task* task, unsigned int place) {
  unsigned int i;
  unsigned int j;
  for (i = 0; i < plchost_task_count; ++i) {
    const struct plchost_task* const other = &plchost_tasks[i];
    if (other == task || (__atomic_load_n(&phases[i], __ATOMIC_SEQ_CST) & any_of) == 0) continue;
    if (plchost_is_stopped(i)) continue;
    for (j = 0; j < other->uses_count; ++j) {
      if (other->uses[j].place == place) return 1;
    }
  }
  return 0;
}

/* ---- Places that share bits: of a task, in a ring ------------------------------------------------------ */

/* A task that comes between may change the place, too: then this one passes on what that one has assigned. */
static void pass_on(const struct plchost_task* task, const struct plchost_use* use, unsigned long long bits) {
  const struct plchost_place* const place = &plchost_places[use->place];
  unsigned long long value;
  do {
    const struct plchost_use* next = &task->uses[use->next];
    value = value_of(place, place->value);
    for (; next != use; next = &task->uses[next->next]) {
      const struct plchost_place* const other = &plchost_places[next->place];
      const unsigned long long theirs = bits_in(other, place, bits);
      unsigned long long before;
      do {
        before = value_at(other->value, other->bytes);
      } while (theirs != 0 &&
               !set_value_if(other->value, other->bytes, before,
                             mixed(value_of(other, &before), bits_in(other, place, value), theirs)));
    }
  } while (((value_of(place, place->value) ^ value) & bits) != 0);
}

/* Of each task those that share bits, in the order of their values. */
static struct plchost_use*** sharing = NULL;

static int compare_values(const void* one, const void* other) {
  const char* const first = (*(struct plchost_use* const*)one)->value;
  const char* const second = (*(struct plchost_use* const*)other)->value;
  return (first > second) - (first < second);
}
static struct plchost_use* sharing_use(const struct plchost_task* task, void* value) {
  struct plchost_use key;
  const struct plchost_use* const wanted = &key;
  struct plchost_use** found;
  if (task->sharing_count == 0) return NULL;
  key.value = value;
  found = bsearch(&wanted, sharing[task - plchost_tasks], task->sharing_count, sizeof(void*), compare_values);
  return found == NULL ? NULL : *found;
}

int plchost_assign_place(const struct plchost_task* task, void* value, const void* now) {
  const struct plchost_use* const use = sharing_use(task, value);
  const struct plchost_place* place;
  unsigned long long assigned = 0;
  unsigned long long before;
  if (use == NULL) return 0;
  place = &plchost_places[use->place];
  memcpy(&assigned, now, place->bytes);
  do {
    before = value_at(value, place->bytes);
  } while (!set_value_if(value, place->bytes, before, assigned));
  pass_on(task, use, value_of(place, &before) ^ value_of(place, &assigned));
  return 1;
}

static void see_places(const struct plchost_task* task) {
  unsigned int i;
  for (i = 0; i < task->sharing_count; ++i)
    task->uses[i].seen = value_of(&plchost_places[task->uses[i].place], task->uses[i].value);
}

static int settle(const struct plchost_task* task, int is_forced) {
  int was_settled = 1;
  unsigned int i;
  for (i = 0; i < task->sharing_count; ++i) {
    const struct plchost_use* const use = &task->uses[i];
    const struct plchost_place* const place = &plchost_places[use->place];
    const unsigned long long value = value_of(place, use->value);
    unsigned long long changed = value ^ use->seen;
    /* The others take from the area what another task has put there already. */
    if (place->area == 'M' && !is_forced) changed &= value ^ exchanged(use->place);
    if (changed == 0) continue;
    pass_on(task, use, changed);
    was_settled = 0;
  }
  see_places(task);
  return !was_settled;
}
int plchost_settle_places(const struct plchost_task* task) {
  return settle(task, 0);
}
int plchost_settle_forced_places(const struct plchost_task* task) {
  return settle(task, 1);
}

/* Bits that are put with one of them count as put with all of them, so nobody puts them again: firmware may
 * have changed them. Before they are in the area, as then no other task takes one of them. */
static void count_as_put(const struct plchost_task* task, const struct plchost_use* use,
                         unsigned long long value, unsigned long long bits) {
  const struct plchost_place* const place = &plchost_places[use->place];
  unsigned int i = (unsigned int)(use - task->uses);
  if (i >= task->sharing_count) return;
  for (i = use->next; &task->uses[i] != use; i = task->uses[i].next) {
    const unsigned int number = task->uses[i].place;
    const struct plchost_place* const other = &plchost_places[number];
    const unsigned long long put = bits_in(other, place, value);
    unsigned long long theirs;
    unsigned long long last;
    do {
      last = exchanged(number);
      theirs = bits_in(other, place, bits) & ~(value_of(other, other->value) ^ put);
    } while (theirs != 0 && !exchange(number, last, mixed(last, put, theirs)));
  }
}

/* ---- Memory -------------------------------------------------------------------------------------------- */

/* Bits of the program that are not those that were exchanged last have been assigned by a task and not been
 * put yet. While another task puts, the area may have older ones than the program. The new ones count as
 * exchanged before the program has them: then a task that comes between knows the old ones for unchanged. */
static void take_memory(const struct plchost_task* task, struct plchost_use* use, const unsigned char* area) {
  const struct plchost_place* const place = &plchost_places[use->place];
  const unsigned long long last = exchanged(use->place);
  unsigned long long before = value_at(place->value, place->bytes);
  const unsigned long long now = load(place, area);
  unsigned long long bits = differ(place, now, last) & ~differ(place, value_of(place, &before), last);
  if (bits != 0 && !another_is_in(PUTS, task, use->place)) {
    set_phase(task, TAKES);
    if (exchange(use->place, last, mixed(last, now, bits))) {
      while (bits != 0 &&
             !set_value_if(place->value, place->bytes, before, mixed(value_of(place, &before), now, bits))) {
        before = value_at(place->value, place->bytes);
        bits &= ~differ(place, value_of(place, &before), last);
      }
    }
    set_phase(task, IN_CYCLE);
  }
  use->before = value_of(place, place->value);
}

/* Bits that this task has not changed are those of another one, which may be in the midst of its cycle, or of
 * an operator. While another task takes, the program may still have those of before. If another task puts
 * between the store and the exchange, its value is newer, and the one in the area is replaced again. */
static void put_memory(const struct plchost_task* task, const struct plchost_use* use, unsigned char* area) {
  const struct plchost_place* const place = &plchost_places[use->place];
  unsigned long long old = 0; /* bits in the area */
  for (;;) {
    const unsigned long long last = exchanged(use->place);
    const unsigned long long value = value_of(place, place->value);
    unsigned long long bits = differ(place, value, last);
    if (bits != 0 && another_is_in(IN_CYCLE, task, use->place)) bits &= differ(place, value, use->before);
    if (bits != 0 && another_is_in(TAKES, task, use->place)) bits = 0;
    bits |= old;
    if (bits == 0) return;
    if (exchanged(use->place) != last || value_of(place, place->value) != value) continue;
    count_as_put(task, use, value, bits);
    store_bits(place, area, value, bits);
    old = exchange(use->place, last, mixed(last, value, bits)) ? 0 : bits;
  }
}

/* An online change: this program takes over from one that runs. */
static int takes_over = 0;
/* Carried over: 1 in a version whose exchanged values are, too. */
static unsigned char knows_exchanged = 0;
static int has_begun = 0;

static void settle_all(void) {
  unsigned int i;
  for (i = 0; i < plchost_task_count; ++i) settle(&plchost_tasks[i], 1);
}

/* Before the first cycle. A place that only this version has was exchanged with nobody: an initial value that
 * is not 0 goes out, else it takes that of the area. Bits that are set in it are set in those that share
 * them. */
static void begin_all(void) {
  unsigned int i;
  unsigned int j;
  for (i = 0; i < plchost_place_count && takes_over && !knows_exchanged; ++i)
    plchost_exchanged[i] = value_of(&plchost_places[i], plchost_places[i].value);
  for (i = 0; i < plchost_task_count && takes_over; ++i) {
    for (j = 0; j < plchost_tasks[i].sharing_count; ++j) plchost_tasks[i].uses[j].seen = 0;
  }
  if (takes_over) settle_all();
  for (i = 0; i < plchost_place_count; ++i) {
    const struct plchost_place* const place = &plchost_places[i];
    if (place->area == 'Q') plchost_exchanged[i] = value_of(place, place->value);
  }
  knows_exchanged = 1;
}

static void put_output(const struct plchost_use* use, unsigned char* area) {
  const struct plchost_place* const place = &plchost_places[use->place];
  unsigned long long* const exchanged = &plchost_exchanged[use->place];
  const unsigned long long value = value_of(place, use->value);
  if (use->others) {
    store(place, area, __atomic_load_n(exchanged, __ATOMIC_SEQ_CST));
  } else {
    __atomic_store_n(exchanged, value, __ATOMIC_SEQ_CST);
    store(place, area, value);
  }
}

void plchost_take_places(const struct plchost_task* task) {
  unsigned char* found[AREAS];
  unsigned int i;
  if (!__atomic_load_n(&has_begun, __ATOMIC_SEQ_CST)) {
    begin_all();
    __atomic_store_n(&has_begun, 1, __ATOMIC_SEQ_CST);
  }
  set_phase(task, IN_CYCLE);
  find_areas(found);
  plchost_settle_places(task);
  for (i = 0; i < task->uses_count; ++i) {
    struct plchost_use* const use = &task->uses[i];
    const struct plchost_place* const place = &plchost_places[use->place];
    const unsigned char* const area = found[area_of(place) - areas];
    if (place->area == 'M') {
      take_memory(task, use, area);
    } else if (place->area == 'I') {
      set_value(use->value, place->bytes, load(place, area));
    }
  }
  see_places(task);
}

void plchost_put_places(const struct plchost_task* task) {
  unsigned char* found[AREAS];
  unsigned int i;
  set_phase(task, PUTS);
  find_areas(found);
  see_places(task);
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

static int sort_sharing(void) {
  unsigned int i;
  unsigned int j;
  unsigned int count = 0;
  struct plchost_use** all;
  for (i = 0; i < plchost_task_count; ++i) count += plchost_tasks[i].sharing_count;
  sharing = malloc((plchost_task_count + count) * sizeof(void*) + 1);
  if (sharing == NULL) return 0;
  all = (struct plchost_use**)(sharing + plchost_task_count);
  for (i = 0; i < plchost_task_count; ++i) {
    const struct plchost_task* const task = &plchost_tasks[i];
    for (j = 0; j < task->sharing_count; ++j) all[j] = &task->uses[j];
    qsort(all, task->sharing_count, sizeof *all, compare_values);
    sharing[i] = all;
    all += task->sharing_count;
  }
  return 1;
}

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
  if (phases == NULL || !sort_sharing()) return 0;
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

static int keep_exchanged(unsigned int number) {
  char name[PLC_MAX_VARIABLE_NAME + 1] = "area-";
  strncat(name, plchost_places[number].name, sizeof name - sizeof "area-");
  return plc_keep_variables(name, &plchost_exchanged[number], sizeof plchost_exchanged[number], 0) == ERR_OK;
}

int plchost_declare_places(void) {
  unsigned int i;
  takes_over = plc_online_change();
  has_begun = 0;
  knows_exchanged = 0;
  settle_all();
  if (plc_keep_variables("exchanged", &knows_exchanged, sizeof knows_exchanged, 0) != ERR_OK) return 0;
  for (i = 0; i < plchost_place_count; ++i) {
    const struct plchost_place* const place = &plchost_places[i];
    plchost_exchanged[i] = takes_over && place->area == 'M' ? 0 : value_of(place, place->value);
    /* An output is what the program has; an edge is one of a value of before. */
    if (plc_keep_variables(place->name, place->value, place->bytes, 0) != ERR_OK) return 0;
    if (place->area == 'M' && !keep_exchanged(i)) return 0;
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
  free(sharing);
}
