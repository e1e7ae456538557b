/*
 * Copies of globals. A program that has some works on them, and no other task changes them in the middle of
 * its cycle. They are exchanged with the globals before and behind its code, of all programs with copies one
 * at a time. So another one takes all that one of them has put, or nothing of it. A task waits for the
 * copying of another one only, which has its priority meanwhile.
 */
#include <pthread.h>
#include <stdint.h>
#include <string.h>

#include "plchost_adapter.h"

static pthread_mutex_t exchanging;

int plchost_prepare_copies(void) {
  pthread_mutexattr_t attributes;
  int result = pthread_mutexattr_init(&attributes);
  if (result != 0) return 0;
  result = pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
  if (result == 0) result = pthread_mutex_init(&exchanging, &attributes);
  pthread_mutexattr_destroy(&attributes);
  return result == 0;
}

void plchost_forget_copies(void) {
  pthread_mutex_destroy(&exchanging);
}

#define COPY_AT_ONCE(type)                                                                             \
  __atomic_store_n((type*)to, __atomic_load_n((const type*)from, __ATOMIC_RELAXED), __ATOMIC_RELAXED); \
  return

/* A value of a task that has no copies is never seen half. */
static void copy_piece(void* to, const void* from, unsigned int bytes) {
  if ((((uintptr_t)to | (uintptr_t)from) & (bytes - 1u)) == 0) {
    switch (bytes) {
      case 1:
        COPY_AT_ONCE(uint8_t);
      case 2:
        COPY_AT_ONCE(uint16_t);
      case 4:
        COPY_AT_ONCE(uint32_t);
      case 8:
        COPY_AT_ONCE(uint64_t);
      default:
        break;
    }
  }
  memcpy(to, from, bytes);
}

static void take(const struct plchost_copy* copy) {
  unsigned int at;
  for (at = 0; at < copy->bytes; at += copy->piece)
    copy_piece((char*)copy->copy + at, (const char*)copy->global + at, copy->piece);
}

/* Only what the program has changed: another task may have changed the rest. */
static void put(const struct plchost_copy* copy) {
  unsigned int at;
  for (at = 0; at < copy->bytes; at += copy->piece) {
    const char* const mine = (const char*)copy->copy + at;
    if (memcmp(mine, (const char*)copy->before + at, copy->piece) != 0)
      copy_piece((char*)copy->global + at, mine, copy->piece);
  }
}

static void exchange(const struct plchost_copy* copies, unsigned int count,
                     void (*work)(const struct plchost_copy*)) {
  unsigned int i;
  pthread_mutex_lock(&exchanging);
  for (i = 0; i < count; ++i) {
    if (copies[i].locked != NULL) {
      copies[i].locked(&copies[i], work);
    } else {
      work(&copies[i]);
    }
  }
  pthread_mutex_unlock(&exchanging);
}

void plchost_take_copies(const struct plchost_copy* copies, unsigned int count) {
  unsigned int i;
  exchange(copies, count, take);
  for (i = 0; i < count; ++i) memcpy(copies[i].before, copies[i].copy, copies[i].bytes);
}

void plchost_put_copies(const struct plchost_copy* copies, unsigned int count) {
  exchange(copies, count, put);
}
