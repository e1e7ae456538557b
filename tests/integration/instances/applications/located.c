/*
 * The file that `plcctl build application` writes beside application.c, by hand. So the adapter is tested
 * without a compiler for Structured Text. kTwice in structured_text_test.cpp is the same program, but for the
 * tasks of external events.
 */
#include "plchost_adapter.h"

typedef unsigned char boolean;
static boolean go, lamp, flag, edges, copy, loops, posts, preset = 9;
static short raw, twice;
static unsigned char byte;

const char plchost_application_name[] = "located";
const char plchost_scheduler[] = "";
const unsigned int plchost_place_count = 11;
const struct plchost_place plchost_places[] = {
    {"__IX0_0", 'I', 1, 0, 0, 0, &go},   {"__IW1", 'I', 2, -1, 0, 2, &raw},
    {"__QX0_1", 'Q', 1, 1, 1, 0, &lamp}, {"__QB0", 'Q', 1, -1, 1, 0, &byte},
    {"__QW1", 'Q', 2, -1, 0, 2, &twice}, {"__QB4", 'Q', 1, -1, 0, 4, &edges},
    {"__QB5", 'Q', 1, -1, 0, 5, &copy},  {"__MX0_3", 'M', 1, 3, 0, 0, &flag},
    {"__QB6", 'Q', 1, -1, 0, 6, &loops}, {"__QB7", 'Q', 1, -1, 0, 7, &preset},
    {"__QB8", 'Q', 1, -1, 0, 8, &posts}};
unsigned long long plchost_exchanged[11];
const unsigned int plchost_location_count = 0;
const struct plchost_location plchost_locations[] = {{0, 0}};

/* The first two share a bit. */
static struct plchost_use of_fast[] = {
    {3, &byte, 0, 1, 0, 0},  {2, &lamp, 0, 0, 0, 0}, {0, &go, 0, 0, 0, 0},   {1, &raw, 0, 0, 0, 0},
    {4, &twice, 0, 0, 0, 0}, {6, &copy, 0, 0, 0, 0}, {7, &flag, 0, 0, 0, 0}, {9, &preset, 0, 0, 0, 0}};
static struct plchost_use of_edge[] = {{5, &edges, 0, 0, 0, 0}};
static struct plchost_use of_loop[] = {{7, &flag, 0, 0, 0, 0}, {8, &loops, 0, 0, 0, 0}};
static struct plchost_use of_posted[] = {{10, &posts, 0, 0, 0, 0}};

static void run_fast(void) {
  plchost_begin(0);
  copy = byte;
  twice = (short)(2 * raw);
  lamp = go;
  flag = go;
  plchost_end(0);
}
static unsigned char edge(void) {
  return go;
}
static void run_edge(void) {
  plchost_begin(1);
  ++edges;
  plchost_end(1);
}
static void run_loop(void) {
  plchost_begin(2);
  loops = flag;
  plchost_end(2);
}

static void run_posted(void) {
  plchost_begin(3);
  ++posts;
  plchost_end(3);
}
static void run_guarded(void) {
  static int cycles;
  if (++cycles < 3) return;
  for (;;) {
  }
}

static const struct plchost_options of_fast_task = {500000L, 1, 1, 0, 1, 0, 0};
static const struct plchost_options of_guarded_task = {0, 0, 0, 20000, 2, 0, 1};
const unsigned int plchost_program_count = 1;
const struct plchost_program plchost_programs[] = {{"cell1", "Cell", "fast"}};
const unsigned int plchost_task_count = 5;
const struct plchost_task plchost_tasks[] = {
    {"fast", 1, 2000000L, 0, run_fast, 8, of_fast, 0, 0, 0, &of_fast_task, 2},
    {"edge", 0, 0, edge, run_edge, 1, of_edge, 0, 0, 0, 0, 0},
    {"loop", 31, 0, 0, run_loop, 2, of_loop, 0, 0, 0, 0, 0},
    {"posted", 2, 0, 0, run_posted, 1, of_posted, 0, 0, "product", 0, 0},
    {"guarded", 3, 0, 0, run_guarded, 0, 0, 0, 0, "product", &of_guarded_task, 0}};

void plchost_each_variable(void (*use)(const struct plchost_variable*)) {
  (void)use;
}
void plchost_each_symbol(void (*use)(const struct plchost_symbol*)) {
  (void)use;
}
void plchost_bind(void) {}
