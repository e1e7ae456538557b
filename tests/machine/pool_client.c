/*
 * A second client of the pool, for containers.sh: a program of another container, where it is process 1.
 *
 *     pool_client post EVENT COUNT   posts to an event of an instance
 *     pool_client hold NAME          locks the mutex NAME, makes the memory NAME.memory, and waits for its
 * end pool_client take NAME          locks the mutex NAME within a second, and says how that went
 */
#include <plc_pool.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define SECOND 1000000000L

static int fail(const char* what) {
  fprintf(stderr, "pool_client: %s: %s\n", what, plc_pool_error());
  return EXIT_FAILURE;
}

static int post(plc_pool* pool, const char* name, unsigned long count) {
  plc_event* event;
  unsigned long i;
  if (plc_event_open(pool, name, PLC_POOL_READ_WRITE, &event) < 0) return fail(name);
  for (i = 0; i < count; ++i) {
    if (plc_event_post(event) < 0) return fail(name);
  }
  plc_event_close(event);
  printf("posted %lu\n", count);
  return EXIT_SUCCESS;
}

static int hold(plc_pool* pool, const char* name) {
  plc_object_options kept;
  plc_mutex* mutex;
  plc_memory* memory;
  char of_memory[64];
  memset(&kept, 0, sizeof kept);
  kept.size = sizeof kept;
  kept.flags = PLC_POOL_KEEP;
  sprintf(of_memory, "%.40s.memory", name);
  if (plc_mutex_create(pool, name, &kept, &mutex) < 0) return fail(name);
  if (plc_memory_create(pool, of_memory, 4096, NULL, &memory) < 0) return fail(of_memory);
  if (plc_mutex_lock(mutex, SECOND) < 0) return fail(name);
  printf("process %ld holds %s\n", (long)getpid(), name);
  fflush(stdout);
  for (;;) pause();
}

static int take(plc_pool* pool, const char* name) {
  plc_mutex* mutex;
  int result;
  if (plc_mutex_open(pool, name, &mutex) < 0) return fail(name);
  result = plc_mutex_lock(mutex, SECOND);
  puts(result == PLC_POOL_OWNER_DIED ? "its owner has ended" : plc_pool_text(result));
  if (result >= 0 && result != PLC_POOL_TIMED_OUT) plc_mutex_unlock(mutex);
  plc_mutex_close(mutex);
  return EXIT_SUCCESS;
}

int main(int argc, char** argv) {
  plc_pool* pool;
  int result = 2;
  signal(SIGTERM, SIG_DFL);
  if (argc < 3) {
    fputs("usage: pool_client post EVENT COUNT | hold NAME | take NAME\n", stderr);
    return result;
  }
  if (plc_pool_open(NULL, PLC_POOL_READ_WRITE, &pool) < 0) return fail("the pool");
  if (strcmp(argv[1], "post") == 0 && argc == 4) result = post(pool, argv[2], strtoul(argv[3], NULL, 10));
  if (strcmp(argv[1], "hold") == 0) result = hold(pool, argv[2]);
  if (strcmp(argv[1], "take") == 0) result = take(pool, argv[2]);
  plc_pool_close(pool);
  return result;
}
