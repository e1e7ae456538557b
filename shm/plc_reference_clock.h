/*
 * The reference record: how firmware (a fieldbus driver, say) tells instances of plchost what its reference
 * clock shows. Plain C89 with GCC's or clang's atomic builtins, nothing to link:
 *
 *     gcc -std=c89 -D_POSIX_C_SOURCE=200809L -I FOLDER_OF_THIS_FILE firmware.c
 *
 *     plc_reference_clock* clock;
 *     int error = plc_reference_clock_open("plchost", "bus1", &clock);      an errno, 0 is success
 *     every cycle of the bus:
 *         local = plc_reference_clock_local_ns();                           both stamps of the same instant
 *         plc_reference_clock_write(clock, reference, local, 1);
 *
 * The record is a shared memory of the pool, the file /dev/shm/POOL.memory.NAME; an instance follows it with
 * [DistributedClock] Reference=NAME in its settings. The names "realtime" and "tai" are those of clocks of
 * the host there: no instance follows a record of such a name. The first one makes it, firmware or instance;
 * it outlives both. It is an object of the pool like all others once a program opens it there by name, or the
 * manager has looked. One writer at a time, any number of readers; nobody ever waits.
 *
 * A pair is good if both stamps are of the same instant. A pair whose stamps were torn apart (the writer lost
 * the processor between them) is left out by the reader, as long as it is not the rule. Best is a local stamp
 * before and one after the reference's, their middle, and no pair if they are far apart. Ten to some thousand
 * pairs per second; more often than every 20 us is not looked at.
 *
 * A writer that is killed inside of plc_reference_clock_write leaves a record that readers do not take; the
 * next write, by whichever process, makes it good again. If the file is removed or emptied, an instance or
 * the next plc_reference_clock_open makes it anew. Firmware that has it mapped then opens it again (in a file
 * that was made empty its next write could be a SIGBUS).
 */
#ifndef PLC_REFERENCE_CLOCK_H
#define PLC_REFERENCE_CLOCK_H

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#ifdef __cplusplus
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
extern "C" {
#endif

/* Whole numbers of 64 bit. */
typedef long plc_clock_i64;
typedef unsigned long plc_clock_u64;
typedef char plc_clock_needs_64_bit_long[sizeof(long) == 8 ? 1 : -1];

#define PLC_REFERENCE_CLOCK_MAGIC 0x6b6c636665726370UL /* "pcrefclk", as bytes in memory */
#define PLC_REFERENCE_CLOCK_VERSION 1u
#define PLC_REFERENCE_CLOCK_PATH "/dev/shm/%s.memory.%s" /* pool, name */

/*
 * The layout. All zero but for the first three is a record into which nothing was written yet. The fields
 * from `sequence` on are only touched with the functions below.
 */
typedef struct {
  plc_clock_u64 magic;        /* written last, by the maker of the record */
  unsigned int version;       /* PLC_REFERENCE_CLOCK_VERSION */
  unsigned int size;          /* of this struct, in bytes */
  plc_clock_u64 sequence;     /* odd while the fields below are being written */
  plc_clock_i64 reference_ns; /* the time of the reference clock, from any zero on */
  plc_clock_i64 local_ns;     /* CLOCK_MONOTONIC at the same instant */
  plc_clock_u64 updates;      /* counts the writes; 0: none yet */
  plc_clock_u64 valid;        /* 1; 0: the writer says that its clock does not hold just now */
  plc_clock_u64 check;        /* of the four before: a mixture of two writers or of a stranger is no pair */
} plc_reference_clock;

/* A copy of one reading. */
typedef struct {
  plc_clock_i64 reference_ns;
  plc_clock_i64 local_ns;
  plc_clock_u64 updates;
  int valid;
} plc_reference_reading;

/* The results of plc_reference_clock_read. */
#define PLC_REFERENCE_OK 0
#define PLC_REFERENCE_NONE 1    /* nothing was written yet */
#define PLC_REFERENCE_BUSY 2    /* it is being written, or its writer ended within: look again later */
#define PLC_REFERENCE_CORRUPT 3 /* not what a writer writes */

static __inline__ plc_clock_u64 plc_reference_clock_check_of(plc_clock_u64 reference, plc_clock_u64 local,
                                                             plc_clock_u64 updates, plc_clock_u64 valid) {
  plc_clock_u64 check = PLC_REFERENCE_CLOCK_MAGIC;
  check = (check ^ reference) * 0x9e3779b97f4a7c15UL;
  check = (check ^ (check >> 32) ^ local) * 0x9e3779b97f4a7c15UL;
  check = (check ^ (check >> 32) ^ updates) * 0x9e3779b97f4a7c15UL;
  check = (check ^ (check >> 32) ^ valid) * 0x9e3779b97f4a7c15UL;
  return check ^ (check >> 32);
}

/* CLOCK_MONOTONIC in nanoseconds: the local stamp. Any context. */
static __inline__ plc_clock_i64 plc_reference_clock_local_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (plc_clock_i64)now.tv_sec * 1000000000L + (plc_clock_i64)now.tv_nsec;
}

/* Writes one pair; `valid` 0: the clock does not hold, its stamps mean nothing. One writer at a time. Takes
 * no lock and makes no system call: real-time. */
static __inline__ void plc_reference_clock_write(plc_reference_clock* clock, plc_clock_i64 reference_ns,
                                                 plc_clock_i64 local_ns, int valid) {
  const plc_clock_u64 flag = valid != 0 ? 1u : 0u;
  const plc_clock_u64 updates = __atomic_load_n(&clock->updates, __ATOMIC_RELAXED) + 1u;
  /* Odd in any case, and another number: a writer that ended within has left an odd one. */
  const plc_clock_u64 odd = (__atomic_load_n(&clock->sequence, __ATOMIC_RELAXED) + 1u) | 1u;
  const plc_clock_u64 check =
      plc_reference_clock_check_of((plc_clock_u64)reference_ns, (plc_clock_u64)local_ns, updates, flag);
  __atomic_store_n(&clock->sequence, odd, __ATOMIC_RELAXED);
  /* Pairs with the acquire fence of the reader: a reader that sees a new field sees the odd sequence. */
  __atomic_thread_fence(__ATOMIC_RELEASE);
  __atomic_store_n(&clock->reference_ns, reference_ns, __ATOMIC_RELAXED);
  __atomic_store_n(&clock->local_ns, local_ns, __ATOMIC_RELAXED);
  __atomic_store_n(&clock->updates, updates, __ATOMIC_RELAXED);
  __atomic_store_n(&clock->valid, flag, __ATOMIC_RELAXED);
  __atomic_store_n(&clock->check, check, __ATOMIC_RELAXED);
  __atomic_store_n(&clock->sequence, odd + 1u, __ATOMIC_RELEASE);
}

/* Reads the last pair, even if a stranger has written there; PLC_REFERENCE_...; `reading` is filled only with
 * _OK. A few attempts, then it gives up: real-time. */
static __inline__ int plc_reference_clock_read(const plc_reference_clock* clock,
                                               plc_reference_reading* reading) {
  int attempt;
  for (attempt = 0; attempt < 4; ++attempt) {
    plc_clock_i64 reference_ns, local_ns;
    plc_clock_u64 updates, valid, check;
    const plc_clock_u64 before = __atomic_load_n(&clock->sequence, __ATOMIC_ACQUIRE);
    if (before == 0) return PLC_REFERENCE_NONE;
    if ((before & 1u) != 0) continue;
    reference_ns = __atomic_load_n(&clock->reference_ns, __ATOMIC_RELAXED);
    local_ns = __atomic_load_n(&clock->local_ns, __ATOMIC_RELAXED);
    updates = __atomic_load_n(&clock->updates, __ATOMIC_RELAXED);
    valid = __atomic_load_n(&clock->valid, __ATOMIC_RELAXED);
    check = __atomic_load_n(&clock->check, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (__atomic_load_n(&clock->sequence, __ATOMIC_RELAXED) != before) continue;
    if (valid > 1u || check != plc_reference_clock_check_of((plc_clock_u64)reference_ns,
                                                            (plc_clock_u64)local_ns, updates, valid)) {
      return PLC_REFERENCE_CORRUPT;
    }
    reading->reference_ns = reference_ns;
    reading->local_ns = local_ns;
    reading->updates = updates;
    reading->valid = valid != 0;
    return PLC_REFERENCE_OK;
  }
  return PLC_REFERENCE_BUSY;
}

/* Makes a new, zeroed memory a record. Two who do so at once write the same. */
static __inline__ void plc_reference_clock_begin(plc_reference_clock* clock) {
  __atomic_store_n(&clock->version, PLC_REFERENCE_CLOCK_VERSION, __ATOMIC_RELAXED);
  __atomic_store_n(&clock->size, (unsigned int)sizeof(plc_reference_clock), __ATOMIC_RELAXED);
  __atomic_store_n(&clock->magic, PLC_REFERENCE_CLOCK_MAGIC, __ATOMIC_RELEASE);
}

/* Whether it is a record of this version. */
static __inline__ int plc_reference_clock_is_one(const plc_reference_clock* clock) {
  return __atomic_load_n(&clock->magic, __ATOMIC_ACQUIRE) == PLC_REFERENCE_CLOCK_MAGIC &&
         __atomic_load_n(&clock->version, __ATOMIC_RELAXED) == PLC_REFERENCE_CLOCK_VERSION &&
         __atomic_load_n(&clock->size, __ATOMIC_RELAXED) == sizeof(plc_reference_clock);
}

/*
 * Opens the record, or makes it (mode 0660). 0, or an errno: ENAMETOOLONG; EPROTO: there is another kind of
 * memory, or another version; those of open, posix_fallocate and mmap. Set-up.
 */
static __inline__ int plc_reference_clock_open(const char* pool, const char* name,
                                               plc_reference_clock** clock) {
  const int flags = O_RDWR | O_CLOEXEC | O_NOFOLLOW;
  char path[256];
  struct stat status;
  void* memory;
  int error = 0;
  int descriptor;
  if (pool[0] == '\0' || name[0] == '\0') return EINVAL;
  if (snprintf(path, sizeof path, PLC_REFERENCE_CLOCK_PATH, pool, name) >= (int)sizeof path)
    return ENAMETOOLONG;
  descriptor = open(path, flags); /* a file of another user opens only without the flag to make it */
  if (descriptor < 0 && errno == ENOENT) descriptor = open(path, flags | O_CREAT | O_EXCL, 0660);
  if (descriptor < 0 && errno == EEXIST) descriptor = open(path, flags);
  if (descriptor < 0) return errno;
  if (fstat(descriptor, &status) != 0) error = errno;
  if (error == 0 && status.st_size == 0) (void)fchmod(descriptor, 0660); /* under any umask */
  if (error == 0 && status.st_size != 0 && status.st_size != (off_t)sizeof(plc_reference_clock))
    error = EPROTO;
  /* No memory is told now, not by SIGBUS in a cycle. Also of a file that somebody has made long, and left. */
  if (error == 0 && status.st_blocks == 0)
    error = posix_fallocate(descriptor, 0, (off_t)sizeof(plc_reference_clock));
  if (error == 0) {
    memory = mmap(NULL, sizeof(plc_reference_clock), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    if (memory == MAP_FAILED) {
      error = errno;
    } else {
      *clock = (plc_reference_clock*)memory;
      if (__atomic_load_n(&(*clock)->magic, __ATOMIC_ACQUIRE) == 0) plc_reference_clock_begin(*clock);
      if (!plc_reference_clock_is_one(*clock)) {
        munmap(memory, sizeof(plc_reference_clock));
        error = EPROTO;
      }
    }
  }
  close(descriptor);
  return error;
}

/* The record itself stays. Set-up. */
static __inline__ void plc_reference_clock_close(plc_reference_clock* clock) {
  munmap(clock, sizeof(plc_reference_clock));
}

#ifdef __cplusplus
}
#pragma GCC diagnostic pop
#endif

#endif
