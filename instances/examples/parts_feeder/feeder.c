/*
 * Firmware in plain C89 that shares objects of the pool with other programs. It is a feeder that puts parts
 * into a tray of four places until somebody has taken as many as it was asked for.
 *
 *     feeder POOL PARTS
 */
#include <plc_pool.h>
#include <stdio.h>
#include <stdlib.h>

#define PLACES 4

typedef struct {
  unsigned int fed;   /* parts that were put in */
  unsigned int taken; /* parts that were taken out */
} tray;

static int fail(const char* what) {
  fprintf(stderr, "feeder: %s: %s\n", what, plc_pool_error());
  return EXIT_FAILURE;
}

int main(int argc, char** argv) {
  plc_pool* pool;
  plc_semaphore* places;
  plc_event* part;
  plc_mutex* lock;
  plc_memory* memory;
  tray* shared;
  unsigned long parts;
  unsigned long i;

  if (argc != 3) {
    fputs("usage: feeder POOL PARTS\n", stderr);
    return 2;
  }
  parts = strtoul(argv[2], NULL, 10);
  if (plc_pool_open(argv[1], PLC_POOL_MAKE, &pool) < 0) return fail(argv[1]);
  if (plc_semaphore_create(pool, "feeder/places", PLACES, NULL, &places) < 0) return fail("places");
  if (plc_event_create(pool, "feeder/part", NULL, &part) < 0) return fail("part");
  if (plc_mutex_create(pool, "feeder/lock", NULL, &lock) < 0) return fail("lock");
  if (plc_memory_create(pool, "feeder/tray", sizeof(tray), NULL, &memory) < 0) return fail("tray");
  shared = (tray*)plc_memory_address(memory);

  for (i = 0; i < parts; ++i) {
    if (plc_semaphore_wait(places, 10000000000L) < 0) {
      fputs("feeder: nobody has taken a part for 10 s\n", stderr);
      return EXIT_FAILURE;
    }
    /* A process that ended with the lock held has changed one number at most: there is nothing to mend. */
    if (plc_mutex_lock(lock, PLC_POOL_FOREVER) < 0) return fail("lock");
    ++shared->fed;
    plc_mutex_unlock(lock);
    plc_event_post(part);
  }
  printf("fed %lu parts\n", parts);

  plc_memory_close(memory);
  plc_mutex_close(lock);
  plc_event_close(part);
  plc_semaphore_close(places);
  plc_pool_close(pool);
  return EXIT_SUCCESS;
}
