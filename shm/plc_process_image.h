/*
 * The process image: how firmware (an I/O driver, say) exchanges inputs and outputs with an instance of
 * plchost. Plain C89 with GCC's or clang's atomic builtins, nothing to link:
 *     gcc -std=c89 -D_POSIX_C_SOURCE=200809L -I FOLDER_OF_THIS_FILE firmware.c
 *
 *     plc_image inputs, outputs;
 *     int error = plc_image_open("plchost", "terminal1.in", 64, PLC_IMAGE_WRITE, &inputs);     an errno
 *     error = plc_image_open("plchost", "terminal1.out", 8, PLC_IMAGE_READ, &outputs);
 *     every cycle of the I/O:
 *         plc_image_read(&outputs, bytes, 0);          the outputs of whole task cycles, never half of one
 *         plc_image_write(&inputs, measured);
 *
 * An image is a shared memory of the pool, the file /dev/shm/POOL.memory.NAME; an instance has its inputs or
 * outputs in it with [SysMem] Linux.Area.n.Object=NAME in its settings. The first one makes it, firmware or
 * instance; it outlives both. It has one writer at a time and any number of readers; nobody ever waits for
 * anybody, also if the other one is pre-empted or killed within. The writer fills a slot that is not the
 * latest and then publishes it. The reader copies the latest and looks whether it was overtaken meanwhile,
 * which takes the writer PLC_IMAGE_SLOTS - 2 publications. The stamp tells when it was published. Inputs are
 * copied in at a cycle's start, outputs out at its end.
 *
 * The dead-man word tells what the writer does, also after its end: plc_image_state(). An instance has a safe
 * image beside its outputs ([SysMem] Linux.Area.n.SafeState). While no task drives the outputs,
 * plc_image_read gives the safe image: after a stop, a fault, a hit of a watchdog, and the end of the
 * process. The instance tells all of them but its own SIGKILL, which the manager tells. If there is no
 * manager either, or the instance stands still, nobody tells it. Firmware has a limit of its own for that,
 * and its own safe state beyond it: plc_image_silence_ns(&outputs).
 *
 * Firmware can be killed, too. plc_image_write_watched() leaves the inputs that programs see then.
 * If the file is removed, the next start or plc_image_open makes it anew: see plc_image_gone().
 */
#ifndef PLC_PROCESS_IMAGE_H
#define PLC_PROCESS_IMAGE_H

#include <errno.h>
#include <fcntl.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#ifdef __cplusplus
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
extern "C" {
#endif

typedef long plc_image_i64;
typedef unsigned long plc_image_u64;
typedef char plc_image_needs_64_bit_long[sizeof(long) == 8 ? 1 : -1];

#define PLC_IMAGE_MAGIC 0x6567616d69636c70UL /* "plcimage", as bytes in memory */
#define PLC_IMAGE_VERSION 2u
#define PLC_IMAGE_PATH "/dev/shm/%s.memory." /* pool; then the name, see plc_image_path() */
#define PLC_IMAGE_PATH_SIZE 265              /* of the longest path, with its end */
#define PLC_IMAGE_MAX_NAME 95u               /* bytes of UTF-8 */
#define PLC_IMAGE_SLOTS 16u                  /* of images that are published one after the other */
#define PLC_IMAGE_SAFE_SLOTS 2u              /* behind them: the safe image, and the next one */
#define PLC_IMAGE_MAX_SIZE 1048576u          /* bytes of inputs or outputs in one image */

/* The dead-man word: the state in the lowest 8 bits, whether the safe image is shown, a count of changes. */
#define PLC_IMAGE_STATE 0xffUL
#define PLC_IMAGE_SHOWS_SAFE 0x100UL
#define PLC_IMAGE_ONE_CHANGE 0x10000UL

#define PLC_IMAGE_STATE_UNTOLD 0u    /* the writer tells none: firmware that writes inputs */
#define PLC_IMAGE_STATE_RUNNING 1u   /* a cycle has ended since the start */
#define PLC_IMAGE_STATE_STOPPED 2u   /* or just started, or between single cycles */
#define PLC_IMAGE_STATE_EXCEPTION 3u /* a fault or a watchdog */
#define PLC_IMAGE_STATE_HALTED 4u    /* a debugger halts a task that writes it */
#define PLC_IMAGE_STATE_ENDED 5u     /* the process has ended, in order or not */
#define PLC_IMAGE_STATE_SILENT 6u    /* told by a reader: no sign of firmware, until its next image */

/* An instance gives a sign every 100 ms. While its tasks rest it is silent when five in a row are missing. */
#define PLC_IMAGE_SIGN_NS 100000000L
#define PLC_IMAGE_PATIENCE_NS (5 * PLC_IMAGE_SIGN_NS)

/* The layout: this, then PLC_IMAGE_SLOTS + PLC_IMAGE_SAFE_SLOTS slots, each a plc_image_slot and the bytes,
 * padded to 64. All zero but for the first four is an image into which nothing was written yet. */
typedef struct {
  plc_image_u64 magic;        /* written last, by the maker of the image */
  unsigned int version;       /* PLC_IMAGE_VERSION */
  unsigned int slots;         /* PLC_IMAGE_SLOTS */
  plc_image_u64 size;         /* bytes of one image */
  plc_image_u64 control;      /* the dead-man word */
  plc_image_u64 safe;         /* sequence of the safe image * 256 + its slot; 0: none */
  plc_image_u64 on_end;       /* the safe image is shown: 1: when the writer has ended, 2: is silent; 0: no */
  plc_image_u64 writer;       /* its process number */
  plc_image_i64 heartbeat_ns; /* CLOCK_MONOTONIC, its last sign */
  plc_image_u64 latest;       /* sequence of the latest image * 256 + its slot; 0: none yet */
  plc_image_u64 holds;        /* 1: outputs hold while no task drives them; 0: their age counts */
  plc_image_u64 reserved[6];
} plc_image_header;

typedef struct {
  plc_image_u64 sequence; /* of the image in it; 0 while it is being written */
  plc_image_i64 stamp_ns; /* CLOCK_MONOTONIC, when it was published */
  plc_image_u64 reserved[6];
} plc_image_slot;

/* An image, opened. The numbers in it are this process's own: values that strangers write into the shared
 * header lead no access outside of the mapping. */
typedef struct {
  plc_image_header* header;
  unsigned long mapped; /* bytes */
  unsigned int size;    /* bytes of one image */
  int descriptor;       /* keeps the writer's lock */
  dev_t device;
  ino_t inode;
} plc_image;

#define PLC_IMAGE_READ 0
#define PLC_IMAGE_WRITE 1 /* and nobody else, as long as it is open: the kernel ends it with the process */
#define PLC_IMAGE_OK 0    /* of plc_image_read: this, or */
#define PLC_IMAGE_NONE 1  /* nothing was written yet */
#define PLC_IMAGE_BUSY 2  /* overtaken each time, or overwritten by a stranger: keep what you have */
#define PLC_IMAGE_ATTEMPTS 4

static __inline__ unsigned long plc_image_stride(unsigned int size) {
  return sizeof(plc_image_slot) + (((unsigned long)size + 63u) & ~63UL);
}

/* Bytes of the whole memory. */
static __inline__ unsigned long plc_image_bytes(unsigned int size) {
  return sizeof(plc_image_header) + (PLC_IMAGE_SLOTS + PLC_IMAGE_SAFE_SLOTS) * plc_image_stride(size);
}

static __inline__ plc_image_slot* plc_image_slot_at(const plc_image* image, unsigned int slot) {
  return (plc_image_slot*)(void*)((char*)image->header + sizeof(plc_image_header) +
                                  slot * plc_image_stride(image->size));
}

/* CLOCK_MONOTONIC in nanoseconds, for comparison with a stamp. Any context. */
static __inline__ plc_image_i64 plc_image_now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (plc_image_i64)now.tv_sec * 1000000000L + (plc_image_i64)now.tv_nsec;
}

/* Fills a slot that nobody reads or writes (more); plc_image_publish makes it the latest. Real-time. */
static __inline__ void plc_image_fill(const plc_image* image, unsigned int number, plc_image_u64 sequence,
                                      const void* bytes, plc_image_i64 stamp_ns) {
  plc_image_slot* const slot = plc_image_slot_at(image, number);
  plc_image_u64* const words = (plc_image_u64*)(void*)(slot + 1);
  const unsigned int whole = image->size / 8u;
  unsigned int i;
  __atomic_store_n(&slot->sequence, 0u, __ATOMIC_RELAXED);
  /* Pairs with the acquire fence of the reader: a reader that sees a new word sees that the slot is being
   * written. */
  __atomic_thread_fence(__ATOMIC_RELEASE);
  for (i = 0; i < whole; ++i) {
    plc_image_u64 word;
    memcpy(&word, (const char*)bytes + 8u * i, 8u);
    __atomic_store_n(&words[i], word, __ATOMIC_RELAXED);
  }
  if (image->size % 8u != 0) {
    plc_image_u64 word = 0;
    memcpy(&word, (const char*)bytes + 8u * whole, image->size % 8u);
    __atomic_store_n(&words[whole], word, __ATOMIC_RELAXED);
  }
  __atomic_store_n(&slot->stamp_ns, stamp_ns, __ATOMIC_RELAXED);
  __atomic_store_n(&slot->sequence, sequence, __ATOMIC_RELEASE);
}

/* The number of the image that follows `latest`, whatever a stranger has made of that. */
static __inline__ plc_image_u64 plc_image_next_sequence(plc_image_u64 latest) {
  const plc_image_u64 next = ((latest >> 8) + 1u) & 0x00ffffffffffffffUL;
  return next == 0 ? 1u : next;
}

/* Publishes `bytes`, image->size of them. One writer at a time. No lock, no system call: real-time. */
static __inline__ void plc_image_write(const plc_image* image, const void* bytes) {
  const plc_image_u64 latest = __atomic_load_n(&image->header->latest, __ATOMIC_RELAXED);
  const unsigned int number = (unsigned int)((latest & 0xffu) + 1u) % PLC_IMAGE_SLOTS;
  const plc_image_u64 sequence = plc_image_next_sequence(latest);
  plc_image_fill(image, number, sequence, bytes, plc_image_now_ns());
  __atomic_store_n(&image->header->latest, sequence << 8 | number, __ATOMIC_RELEASE);
}

/* Copies the image that `latest` names, one of those or the safe one. 1: done, and it was not overwritten
 * meanwhile. Real-time. */
static __inline__ int plc_image_copy(const plc_image* image, plc_image_u64 latest, void* bytes,
                                     plc_image_i64* stamp_ns) {
  const unsigned int number = (unsigned int)(latest & 0xffu);
  const unsigned int whole = image->size / 8u;
  const plc_image_slot* slot;
  const plc_image_u64* words;
  unsigned int i;
  if (number >= PLC_IMAGE_SLOTS + PLC_IMAGE_SAFE_SLOTS) return 0;
  slot = plc_image_slot_at(image, number);
  words = (const plc_image_u64*)(const void*)(slot + 1);
  if (__atomic_load_n(&slot->sequence, __ATOMIC_ACQUIRE) != latest >> 8) return 0;
  for (i = 0; i < whole; ++i) {
    const plc_image_u64 word = __atomic_load_n(&words[i], __ATOMIC_RELAXED);
    memcpy((char*)bytes + 8u * i, &word, 8u);
  }
  if (image->size % 8u != 0) {
    const plc_image_u64 word = __atomic_load_n(&words[whole], __ATOMIC_RELAXED);
    memcpy((char*)bytes + 8u * whole, &word, image->size % 8u);
  }
  if (stamp_ns != NULL) *stamp_ns = __atomic_load_n(&slot->stamp_ns, __ATOMIC_RELAXED);
  __atomic_thread_fence(__ATOMIC_ACQUIRE);
  return __atomic_load_n(&slot->sequence, __ATOMIC_RELAXED) == latest >> 8;
}

/* The dead-man word. Any context. */
static __inline__ plc_image_u64 plc_image_control(const plc_image* image) {
  return __atomic_load_n(&image->header->control, __ATOMIC_ACQUIRE);
}

/* PLC_IMAGE_STATE_..., as the writer told it last, or the manager for it. Any context. */
static __inline__ unsigned int plc_image_state(const plc_image* image) {
  return (unsigned int)(plc_image_control(image) & PLC_IMAGE_STATE);
}

static __inline__ int plc_image_read_of(const plc_image* image, plc_image_u64 safe_if, void* bytes,
                                        plc_image_i64* stamp_ns) {
  int attempt;
  for (attempt = 0; attempt < PLC_IMAGE_ATTEMPTS; ++attempt) {
    const int safe = safe_if != 0 && (plc_image_control(image) & safe_if) != 0;
    const plc_image_u64 shown =
        __atomic_load_n(safe ? &image->header->safe : &image->header->latest, __ATOMIC_ACQUIRE);
    if (shown == 0) return PLC_IMAGE_NONE;
    if (plc_image_copy(image, shown, bytes, stamp_ns)) return PLC_IMAGE_OK;
  }
  return PLC_IMAGE_BUSY;
}

/* Copies the latest image, whatever is shown: for tasks of the writer. Otherwise as plc_image_read. */
static __inline__ int plc_image_read_latest(const plc_image* image, void* bytes, plc_image_i64* stamp_ns) {
  return plc_image_read_of(image, 0, bytes, stamp_ns);
}

/* Copies the image that is shown to `bytes`, image->size of them: the latest, or the safe one. PLC_IMAGE_...;
 * `stamp_ns` may be null. Unless it says PLC_IMAGE_OK, what is in `bytes` may be half of another image. A few
 * attempts, then it gives up: real-time. */
static __inline__ int plc_image_read(const plc_image* image, void* bytes, plc_image_i64* stamp_ns) {
  return plc_image_read_of(image, PLC_IMAGE_SHOWS_SAFE, bytes, stamp_ns);
}

/* An age that is beyond each limit: nothing was written, or a stranger has written it. */
#define PLC_IMAGE_NEVER 0x7fffffffffffffffL

static __inline__ plc_image_i64 plc_image_age_of(plc_image_i64 stamp_ns) {
  const plc_image_i64 now = plc_image_now_ns();
  return stamp_ns <= 0 || stamp_ns > now ? PLC_IMAGE_NEVER : now - stamp_ns;
}

/* Since the image that `word` of the header names was published; or PLC_IMAGE_NEVER. Real-time. */
static __inline__ plc_image_i64 plc_image_age_by(const plc_image* image, const plc_image_u64* word) {
  int attempt;
  for (attempt = 0; attempt < PLC_IMAGE_ATTEMPTS; ++attempt) {
    const plc_image_u64 named = __atomic_load_n(word, __ATOMIC_ACQUIRE);
    const plc_image_slot* slot;
    plc_image_i64 stamp_ns;
    if (named == 0 || (named & 0xffu) >= PLC_IMAGE_SLOTS + PLC_IMAGE_SAFE_SLOTS) break;
    slot = plc_image_slot_at(image, (unsigned int)(named & 0xffu));
    stamp_ns = __atomic_load_n(&slot->stamp_ns, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (__atomic_load_n(&slot->sequence, __ATOMIC_RELAXED) == named >> 8) return plc_image_age_of(stamp_ns);
  }
  return PLC_IMAGE_NEVER;
}

/* Since the latest image was published, whatever is shown; or PLC_IMAGE_NEVER. Real-time. */
static __inline__ plc_image_i64 plc_image_age_ns(const plc_image* image) {
  return plc_image_age_by(image, &image->header->latest);
}

/* Since the last sign of the writer; or PLC_IMAGE_NEVER: it gives none. Real-time. */
static __inline__ plc_image_i64 plc_image_heartbeat_age_ns(const plc_image* image) {
  return plc_image_age_of(__atomic_load_n(&image->header->heartbeat_ns, __ATOMIC_RELAXED));
}

/* How long nobody has said which outputs hold; 0: the writer gives signs, or has told its end. While it runs
 * this is the age of the latest image, so the limit must be longer than the interval of the tasks. While its
 * tasks rest it is the time since the fifth sign that is missing. If its settings name no safe state, it is
 * the age in each state. PLC_IMAGE_NEVER: nothing was written yet, or it is spoiled. Real-time. */
static __inline__ plc_image_i64 plc_image_silence_ns(const plc_image* image) {
  const plc_image_header* const header = image->header;
  const plc_image_u64 control = plc_image_control(image);
  const plc_image_u64 state = control & PLC_IMAGE_STATE;
  const int rests = state >= PLC_IMAGE_STATE_STOPPED && state <= PLC_IMAGE_STATE_ENDED;
  const int safe = (control & PLC_IMAGE_SHOWS_SAFE) != 0;
  const plc_image_i64 age_ns = plc_image_age_by(image, safe ? &header->safe : &header->latest);
  const plc_image_i64 sign_ns = state == PLC_IMAGE_STATE_ENDED ? 0 : plc_image_heartbeat_age_ns(image);
  if (!rests || __atomic_load_n(&header->holds, __ATOMIC_RELAXED) == 0) return plc_image_age_ns(image);
  if (age_ns == PLC_IMAGE_NEVER || sign_ns == PLC_IMAGE_NEVER) return PLC_IMAGE_NEVER;
  return sign_ns > PLC_IMAGE_PATIENCE_NS ? sign_ns - PLC_IMAGE_PATIENCE_NS : 0;
}

/* Makes `bytes` the safe image. The one before is whole until then. One writer at a time. Real-time. */
static __inline__ void plc_image_set_safe(const plc_image* image, const void* bytes) {
  const plc_image_u64 before = __atomic_load_n(&image->header->safe, __ATOMIC_RELAXED);
  const unsigned int number = (before & 0xffu) == PLC_IMAGE_SLOTS ? PLC_IMAGE_SLOTS + 1u : PLC_IMAGE_SLOTS;
  const plc_image_u64 sequence = plc_image_next_sequence(before);
  plc_image_fill(image, number, sequence, bytes, plc_image_now_ns());
  __atomic_store_n(&image->header->safe, sequence << 8 | number, __ATOMIC_RELEASE);
}

/* 0: nobody says that outputs hold while no task drives them, so readers go by the age. Set-up. */
static __inline__ void plc_image_hold(const plc_image* image, int holds) {
  __atomic_store_n(&image->header->holds, holds ? 1u : 0u, __ATOMIC_RELAXED);
}

/* Tells a state, and whether the safe image is shown, if `told` is still told. 1: done. Any context. */
static __inline__ int plc_image_tell_since(const plc_image* image, plc_image_u64 told, unsigned int state,
                                           int safe) {
  const plc_image_u64 now = (told / PLC_IMAGE_ONE_CHANGE + 1u) * PLC_IMAGE_ONE_CHANGE |
                            (safe ? PLC_IMAGE_SHOWS_SAFE : 0u) | (plc_image_u64)state;
  return __atomic_compare_exchange_n(&image->header->control, &told, now, 0, __ATOMIC_RELEASE,
                                     __ATOMIC_RELAXED);
}

/* Tells a state; `safe`: from now on the safe image is shown, until plc_image_resume. Any context. */
static __inline__ void plc_image_tell(const plc_image* image, unsigned int state, int safe) {
  plc_image_u64 told;
  do {
    told = plc_image_control(image);
  } while (!plc_image_tell_since(image, told, state, safe || (told & PLC_IMAGE_SHOWS_SAFE) != 0));
}

/* After plc_image_write: shows what is published, unless another word was told since `told`. Real-time. */
static __inline__ void plc_image_resume(const plc_image* image, plc_image_u64 told) {
  (void)plc_image_tell_since(image, told, PLC_IMAGE_STATE_RUNNING, 0);
}

/* A sign of the writer. Any context. */
static __inline__ void plc_image_beat(const plc_image* image) {
  __atomic_store_n(&image->header->heartbeat_ns, plc_image_now_ns(), __ATOMIC_RELAXED);
}

/* For firmware, in place of plc_image_write, at least every PLC_IMAGE_SIGN_NS. Once it has given no sign for
 * PLC_IMAGE_PATIENCE_NS, instances show `at_end` to all readers until the next call. Real-time. */
static __inline__ void plc_image_write_watched(const plc_image* image, const void* bytes,
                                               const void* at_end) {
  plc_image_set_safe(image, at_end);
  plc_image_beat(image);
  __atomic_store_n(&image->header->on_end, 2u, __ATOMIC_RELEASE); /* also if the first call is cut off here */
  plc_image_write(image, bytes);
  do /* a reader that has looked before the beat may tell the silence once more */
    plc_image_resume(image, plc_image_control(image));
  while (plc_image_state(image) == PLC_IMAGE_STATE_SILENT);
}

/* Begins to write, as process number `writer`: before anything is told. Set-up. */
static __inline__ void plc_image_take(const plc_image* image, plc_image_u64 writer) {
  __atomic_store_n(&image->header->writer, writer, __ATOMIC_RELAXED);
}

/* For another process: process number `writer` has ended without a word. 0: the next writer has taken the
 * image already, and it is left alone. Any context. */
static __inline__ int plc_image_end_of(const plc_image* image, plc_image_u64 writer) {
  const plc_image_u64 told = plc_image_control(image);
  const int safe =
      (told & PLC_IMAGE_SHOWS_SAFE) != 0 || __atomic_load_n(&image->header->on_end, __ATOMIC_RELAXED) != 0;
  /* After the word: the next writer takes the image before it tells one. */
  if (__atomic_load_n(&image->header->writer, __ATOMIC_RELAXED) != writer) return 0;
  return plc_image_tell_since(image, told, PLC_IMAGE_STATE_ENDED, safe);
}

/* Changes with each publication. Any context. */
static __inline__ plc_image_u64 plc_image_sequence(const plc_image* image) {
  return __atomic_load_n(&image->header->latest, __ATOMIC_ACQUIRE) >> 8;
}

/* Makes a new, zeroed memory an image. Two who do so at once write the same. */
static __inline__ void plc_image_begin(plc_image_header* header, unsigned int size) {
  __atomic_store_n(&header->version, PLC_IMAGE_VERSION, __ATOMIC_RELAXED);
  __atomic_store_n(&header->slots, PLC_IMAGE_SLOTS, __ATOMIC_RELAXED);
  __atomic_store_n(&header->size, (plc_image_u64)size, __ATOMIC_RELAXED);
  __atomic_store_n(&header->magic, PLC_IMAGE_MAGIC, __ATOMIC_RELEASE);
}

/* Whether it is an image of this version and size. */
static __inline__ int plc_image_is_one(const plc_image_header* header, unsigned int size) {
  return __atomic_load_n(&header->magic, __ATOMIC_ACQUIRE) == PLC_IMAGE_MAGIC &&
         __atomic_load_n(&header->version, __ATOMIC_RELAXED) == PLC_IMAGE_VERSION &&
         __atomic_load_n(&header->slots, __ATOMIC_RELAXED) == PLC_IMAGE_SLOTS &&
         __atomic_load_n(&header->size, __ATOMIC_RELAXED) == size;
}

/* The file of an image, `path` having PLC_IMAGE_PATH_SIZE bytes: characters that no file name should have
 * stand there as % and two hexadecimal digits. EINVAL: no name, or control characters. ENAMETOOLONG. Set-up.
 */
static __inline__ int plc_image_path(const char* pool, const char* name, char* path) {
  static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";
  int end;
  if (pool[0] == '\0' || name[0] == '\0') return EINVAL;
  if (strlen(name) > PLC_IMAGE_MAX_NAME) return ENAMETOOLONG;
  end = snprintf(path, PLC_IMAGE_PATH_SIZE, PLC_IMAGE_PATH, pool);
  for (; *name != '\0'; ++name) {
    const unsigned char c = (unsigned char)*name;
    if (end + 4 > PLC_IMAGE_PATH_SIZE) return ENAMETOOLONG;
    if (c < 0x20 || c == 0x7f) return EINVAL;
    if (c >= 0x80 || strchr(plain, c) != NULL)
      path[end++] = *name;
    else
      end += snprintf(path + end, 4, "%%%02X", (unsigned int)c);
  }
  path[end] = '\0';
  return 0;
}

/* The file is not what the name leads to any more: open it again. Set-up. */
static __inline__ int plc_image_gone(const plc_image* image, const char* pool, const char* name) {
  char path[PLC_IMAGE_PATH_SIZE];
  struct stat status;
  if (plc_image_path(pool, name, path) != 0) return 1;
  return stat(path, &status) != 0 || status.st_dev != image->device || status.st_ino != image->inode ||
         (unsigned long)status.st_size != image->mapped;
}

/* Unmaps it; the image itself stays. Set-up. */
static __inline__ void plc_image_close(plc_image* image) {
  if (image->header != NULL) munmap(image->header, image->mapped);
  if (image->descriptor >= 0) close(image->descriptor);
  image->header = NULL;
  image->descriptor = -1;
}

/* Gives an empty file its size, and maps it. An errno. */
static __inline__ int plc_image_map(plc_image* image) {
  struct stat status;
  void* memory;
  int error = 0;
  if (fstat(image->descriptor, &status) != 0) return errno;
  if (!S_ISREG(status.st_mode)) return EPROTO;
  if (status.st_size == 0) (void)fchmod(image->descriptor, 0660); /* under any umask */
  if (status.st_size != 0 && (unsigned long)status.st_size != image->mapped) return EPROTO;
  /* No memory is told now, not by SIGBUS in a cycle. Also of a file that somebody has made long, and left. */
  if ((unsigned long)status.st_blocks * 512u < image->mapped) {
    error = posix_fallocate(image->descriptor, 0, (off_t)image->mapped);
    if (error != 0) return error;
    if (fstat(image->descriptor, &status) != 0) return errno;
  }
  if ((unsigned long)status.st_size != image->mapped) return EPROTO;
  memory = mmap(NULL, image->mapped, PROT_READ | PROT_WRITE, MAP_SHARED, image->descriptor, 0);
  if (memory == MAP_FAILED) return errno;
  image->header = (plc_image_header*)memory;
  image->device = status.st_dev;
  image->inode = status.st_ino;
  if (__atomic_load_n(&image->header->magic, __ATOMIC_ACQUIRE) == 0)
    plc_image_begin(image->header, image->size);
  return plc_image_is_one(image->header, image->size) ? 0 : EPROTO;
}

/* Readers go on with the image that the writer before has left for its end, until the first one of this one.
 * An instance may have had its outputs in the image of a writer that tells no state. */
static __inline__ void plc_image_tell_nothing(const plc_image* image) {
  const unsigned int safe = (unsigned int)(__atomic_load_n(&image->header->safe, __ATOMIC_ACQUIRE) & 0xffu);
  plc_image_u64 told = plc_image_control(image);
  const int shown =
      (told & PLC_IMAGE_SHOWS_SAFE) != 0 || __atomic_load_n(&image->header->on_end, __ATOMIC_RELAXED) != 0;
  if (shown && safe - PLC_IMAGE_SLOTS < PLC_IMAGE_SAFE_SLOTS)
    plc_image_write(image, plc_image_slot_at(image, safe) + 1);
  plc_image_take(image, (plc_image_u64)getpid());
  __atomic_store_n(&image->header->on_end, 0u, __ATOMIC_RELAXED);
  plc_image_hold(image, 0);
  do {
    told = plc_image_control(image);
  } while (told != 0 && !plc_image_tell_since(image, told, PLC_IMAGE_STATE_UNTOLD, 0));
}

/* Opens the image of `size` bytes, or makes it (mode 0660). 0, or an errno. EINVAL: no name, or size.
 * ENAMETOOLONG. EPROTO: there is another kind of memory, another size, or the version of another header. Then
 * remove the file while no program uses it. EBUSY: it has a writer already. Others: those of open,
 * posix_fallocate and mmap. Set-up. */
static __inline__ int plc_image_open(const char* pool, const char* name, unsigned int size, int access,
                                     plc_image* image) {
  const int flags = O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  char path[PLC_IMAGE_PATH_SIZE];
  int error = plc_image_path(pool, name, path);
  memset(image, 0, sizeof *image);
  image->descriptor = -1;
  if (error != 0) return error;
  if (size == 0 || size > PLC_IMAGE_MAX_SIZE) return EINVAL;
  image->size = size;
  image->mapped = plc_image_bytes(size);
  image->descriptor = open(path, flags); /* a file of another user opens only without the flag to make it */
  if (image->descriptor < 0 && errno == ENOENT)
    image->descriptor = open(path, flags | O_CREAT | O_EXCL, 0660);
  if (image->descriptor < 0 && errno == EEXIST) image->descriptor = open(path, flags);
  if (image->descriptor < 0) return errno;
  if (access == PLC_IMAGE_WRITE && flock(image->descriptor, LOCK_EX | LOCK_NB) != 0)
    error = errno == EWOULDBLOCK ? EBUSY : errno;
  if (error == 0) error = plc_image_map(image);
  if (error == 0 && access == PLC_IMAGE_WRITE) plc_image_tell_nothing(image);
  if (error != 0) plc_image_close(image);
  return error;
}

#ifdef __cplusplus
}
#pragma GCC diagnostic pop
#endif
#endif
