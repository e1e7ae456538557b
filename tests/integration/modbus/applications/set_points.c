/*
 * The file that `plcctl build application` writes beside application.c, by hand: a program with %M locations,
 * of which a Modbus client writes %MW0, %MX8.1 and %MD3. It writes the others in each cycle, and counts in
 * %MW3 how often one of those had changed without it, and in %MW5 values of %MD3 whose halves differ.
 */
#include "plchost_adapter.h"

typedef unsigned char boolean;
static unsigned short set_point, count, echo, lost, torn;
static boolean toggles, wanted, lamp;
static unsigned int wide;

const char plchost_application_name[] = "set_points";
const char plchost_scheduler[] = "";
const unsigned int plchost_place_count = 9;
const struct plchost_place plchost_places[] = {
    {"__MW0", 'M', 2, -1, 0, 0, &set_point}, {"__MW1", 'M', 2, -1, 0, 2, &count},
    {"__MW2", 'M', 2, -1, 0, 4, &echo},      {"__MW3", 'M', 2, -1, 0, 6, &lost},
    {"__MX8_0", 'M', 1, 0, 0, 8, &toggles},  {"__MX8_1", 'M', 1, 1, 0, 8, &wanted},
    {"__MX8_2", 'M', 1, 2, 0, 8, &lamp},     {"__MW5", 'M', 2, -1, 0, 10, &torn},
    {"__MD3", 'M', 4, -1, 0, 12, &wide}};
unsigned long long plchost_exchanged[9];
const unsigned int plchost_location_count = 0;
struct plchost_location plchost_locations[] = {{0, 0, 0}};

static struct plchost_use of_fast[] = {{0, &set_point, 0, 0}, {1, &count, 0, 0},   {2, &echo, 0, 0},
                                       {3, &lost, 0, 0},      {4, &toggles, 0, 0}, {5, &wanted, 0, 0},
                                       {6, &lamp, 0, 0},      {7, &torn, 0, 0},    {8, &wide, 0, 0}};

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
}

const unsigned int plchost_program_count = 1;
const struct plchost_program plchost_programs[] = {{"cell1", "Cell", "fast"}};
const unsigned int plchost_task_count = 1;
const struct plchost_task plchost_tasks[] = {{"fast", 1, 1000000L, 0, run_fast, 9, of_fast, 0, 0, 0, 0}};

void plchost_each_variable(void (*use)(const struct plchost_variable*)) {
  (void)use;
}
void plchost_each_symbol(void (*use)(const struct plchost_symbol*)) {
  (void)use;
}
void plchost_bind(void) {}
