/*
 * The file that `plcctl build application` writes beside application.c, by hand. So the adapter is tested
 * without a compiler for Structured Text. kTwice in structured_text_test.cpp is the same program, but for the
 * tasks of external events.
 */
#include "plchost_matiec.h"

typedef unsigned char boolean;
static boolean go, lamp, flag, edges, copy, loops, posts, preset = 9;
static short raw, twice;
static unsigned char byte;

const char plchost_application_name[] = "located";
const unsigned int plchost_place_count = 11;
const struct plchost_place plchost_places[] = {
    {'I', 1, 0, 0, &go},      /* %IX0.0 */
    {'I', 2, -1, 2, &raw},    /* %IW1 */
    {'Q', 1, 1, 0, &lamp},    /* %QX0.1 */
    {'Q', 1, -1, 0, &byte},   /* %QB0, the byte around it */
    {'Q', 2, -1, 2, &twice},  /* %QW1 */
    {'Q', 1, -1, 4, &edges},  /* %QB4 */
    {'Q', 1, -1, 5, &copy},   /* %QB5 */
    {'M', 1, 3, 0, &flag},    /* %MX0.3 */
    {'Q', 1, -1, 6, &loops},  /* %QB6 */
    {'Q', 1, -1, 7, &preset}, /* %QB7 */
    {'Q', 1, -1, 8, &posts}   /* %QB8 */
};

static const unsigned int of_fast[] = {0, 1, 2, 3, 4, 6, 7, 9};
static const unsigned int of_edge[] = {5};
static const unsigned int of_loop[] = {7, 8};
static const unsigned int of_posted[] = {10};
static unsigned long long at_begin_of_fast[8], at_begin_of_edge[1], at_begin_of_loop[2];
static unsigned long long at_begin_of_posted[1];

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
const unsigned int plchost_task_count = 5;
const struct plchost_task plchost_tasks[] = {
    {"fast", 1, 2000000L, 0, run_fast, 8, of_fast, at_begin_of_fast, 0, &of_fast_task},
    {"edge", 0, 0, edge, run_edge, 1, of_edge, at_begin_of_edge, 0, 0},
    {"loop", 31, 0, 0, run_loop, 2, of_loop, at_begin_of_loop, 0, 0},
    {"posted", 2, 0, 0, run_posted, 1, of_posted, at_begin_of_posted, "product", 0},
    {"guarded", 3, 0, 0, run_guarded, 0, 0, 0, "product", &of_guarded_task}};

void config_init__(void) {}
