/*
 * The file that `plcctl build application` writes beside application.c, by hand: a program with %M locations,
 * of which a Modbus client writes %MW0, %MX8.1, %MD3, %MW8 and %MW10. It writes the others in each cycle, and
 * counts in %MW3 how often one of those had changed without it, and in %MW5 values of %MD3 whose halves
 * differ.
 *
 * A task of low priority assigns %MW8, and counts in %MW9 how often that was gone before its cycle's end, in
 * which the fast one has come between. One that runs each second puts %MW10 out as %MW11.
 */
#include "plchost_adapter.h"

typedef unsigned char boolean;
static unsigned short set_point, count, echo, lost, torn;
static unsigned short assigned, gone, rare_point, rare_echo;
static boolean toggles, wanted, lamp;
static unsigned int wide;

const char plchost_application_name[] = "set_points";
const char plchost_scheduler[] = "";
const unsigned int plchost_place_count = 13;
const struct plchost_place plchost_places[] = {
    {"__MW0", 'M', 2, -1, 0, 0, &set_point},  {"__MW1", 'M', 2, -1, 0, 2, &count},
    {"__MW2", 'M', 2, -1, 0, 4, &echo},       {"__MW3", 'M', 2, -1, 0, 6, &lost},
    {"__MX8_0", 'M', 1, 0, 0, 8, &toggles},   {"__MX8_1", 'M', 1, 1, 0, 8, &wanted},
    {"__MX8_2", 'M', 1, 2, 0, 8, &lamp},      {"__MW5", 'M', 2, -1, 0, 10, &torn},
    {"__MD3", 'M', 4, -1, 0, 12, &wide},      {"__MW8", 'M', 2, -1, 0, 16, &assigned},
    {"__MW9", 'M', 2, -1, 0, 18, &gone},      {"__MW10", 'M', 2, -1, 0, 20, &rare_point},
    {"__MW11", 'M', 2, -1, 0, 22, &rare_echo}};
unsigned long long plchost_exchanged[13];
const unsigned int plchost_location_count = 0;
const struct plchost_location plchost_locations[] = {{0, 0}};

static struct plchost_use of_fast[] = {
    {0, &set_point, 0, 0, 0, 0}, {1, &count, 0, 0, 0, 0},   {2, &echo, 0, 0, 0, 0}, {3, &lost, 0, 0, 0, 0},
    {4, &toggles, 0, 0, 0, 0},   {5, &wanted, 0, 0, 0, 0},  {6, &lamp, 0, 0, 0, 0}, {7, &torn, 0, 0, 0, 0},
    {8, &wide, 0, 0, 0, 0},      {9, &assigned, 0, 0, 0, 0}};
static struct plchost_use of_slow[] = {{9, &assigned, 0, 0, 0, 0}, {10, &gone, 0, 0, 0, 0}};
static struct plchost_use of_rare[] = {{11, &rare_point, 0, 0, 0, 0}, {12, &rare_echo, 0, 0, 0, 0}};
static unsigned int cycles;

static void run_fast(void) {
  static unsigned short own_count;
  static boolean own_toggles;
  plchost_begin(0);
  if (count != own_count || toggles != own_toggles) ++lost;
  if (wide >> 16 != (wide & 0xffffu)) ++torn;
  own_count = ++count;
  own_toggles = toggles = !toggles;
  echo = set_point;
  lamp = wanted;
  plchost_end(0);
  __atomic_add_fetch(&cycles, 1, __ATOMIC_RELAXED);
}

static void run_slow(void) {
  static unsigned short own;
  unsigned int begin;
  plchost_begin(1);
  __atomic_store_n(&assigned, ++own, __ATOMIC_RELAXED);
  begin = __atomic_load_n(&cycles, __ATOMIC_RELAXED);
  while (__atomic_load_n(&cycles, __ATOMIC_RELAXED) - begin < 3) {
  }
  if (__atomic_load_n(&assigned, __ATOMIC_RELAXED) != own) ++gone;
  plchost_end(1);
}

static void run_rare(void) {
  plchost_begin(2);
  rare_echo = rare_point;
  plchost_end(2);
}

const unsigned int plchost_program_count = 1;
const struct plchost_program plchost_programs[] = {{"cell1", "Cell", "fast"}};
const unsigned int plchost_task_count = 3;
const struct plchost_task plchost_tasks[] = {
    {"fast", 1, 1000000L, 0, run_fast, 10, of_fast, 0, 0, 0, 0, 0},
    {"slow", 31, 0, 0, run_slow, 2, of_slow, 0, 0, 0, 0, 0},
    {"rare", 2, 1000000000L, 0, run_rare, 2, of_rare, 0, 0, 0, 0, 0}};

void plchost_each_variable(void (*use)(const struct plchost_variable*)) {
  (void)use;
}
void plchost_each_symbol(void (*use)(const struct plchost_symbol*)) {
  (void)use;
}
void plchost_bind(void) {}
