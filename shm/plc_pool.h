/*
 * The object pool of plchost for firmware: named events, semaphores, mutexes and memories, shared with the
 * instances and with all other programs of the host. Plain C89; link with -lplcpool:
 *
 *     gcc -std=c89 firmware.c $(pkg-config --cflags --libs plcpool)
 *
 *     plc_pool* pool;
 *     plc_event* ready;
 *     if (plc_pool_open("plchost", PLC_POOL_READ_WRITE, &pool) < 0 ||
 *         plc_event_create(pool, "line1/ready", NULL, &ready) < 0)
 *       puts(plc_pool_error());
 *     plc_event_post(ready);
 *
 * An object is found by its name: 1 to 95 bytes of UTF-8 without control characters. It goes with the last
 * reference, also if that belongs to a process that is killed, unless it was made with PLC_POOL_KEEP. Objects
 * of an instance's application are "INSTANCE/NAME" by custom; its external events are.
 *
 * Results: 0 and above is success, below 0 is failure; then plc_pool_error() says in words what was wrong. A
 * handle is used by any number of threads at once, and closed by one when no other uses it (any more).
 *
 * Contexts: "set-up" takes the pool's lock and may allocate. The context "any" includes the cycle of a
 * real-time task: bounded by its timeout, no allocation, and no system call unless it has to wait or to wake.
 * After fork() the child opens the pool anew.
 */
#ifndef PLC_POOL_H
#define PLC_POOL_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#define PLC_POOL_ABI_VERSION 1

/* Whole numbers of 64 bit. */
typedef unsigned long plc_pool_u64;
typedef char plc_pool_needs_64_bit_long[sizeof(long) == 8 ? 1 : -1];

typedef struct plc_pool plc_pool;
typedef struct plc_event plc_event;
typedef struct plc_semaphore plc_semaphore;
typedef struct plc_mutex plc_mutex;
typedef struct plc_memory plc_memory;

/* ---- Results ---------------------------------------------------------------------------------------------
 */

#define PLC_POOL_OK 0
#define PLC_POOL_ALREADY_THERE 1 /* create: opened, somebody else has made it */
#define PLC_POOL_OWNER_DIED 2    /* lock: locked; the last holder ended within: check the guarded data */
#define PLC_POOL_ARGUMENT (-1)   /* a null pointer, or a name, size or value that is not allowed */
#define PLC_POOL_NO_OBJECT (-2)  /* no pool or no object of that name */
#define PLC_POOL_WRONG_TYPE (-3) /* the object of that name is of another type */
#define PLC_POOL_WRONG_SIZE (-4) /* the memory of that name has another size */
#define PLC_POOL_FULL (-5) /* no room in the pool, or for the memory; a semaphore at its greatest value */
#define PLC_POOL_TIMED_OUT (-6)
#define PLC_POOL_REFUSED (-7)   /* its rights do not allow it, or it was opened to read only */
#define PLC_POOL_DEADLOCK (-8)  /* this thread holds the mutex already */
#define PLC_POOL_NOT_OWNER (-9) /* this thread does not hold the mutex */
#define PLC_POOL_GONE (-10)     /* the pool was damaged, and the object lost */
#define PLC_POOL_CORRUPT (-11)  /* the thing there is not of this kind or version, or was scribbled over */
#define PLC_POOL_SYSTEM (-12)   /* the operating system refused; after fork(): open the pool anew */

/* The error text of the last set-up call of this thread that failed; "" if none has. Valid until the next
 * one.
 */
const char* plc_pool_error(void);
/* The result in a few words. Any. */
const char* plc_pool_text(int result);

/* ---- The pool --------------------------------------------------------------------------------------------
 */

#define PLC_POOL_READ 0       /* list, look, and map memories whose rights allow to read them */
#define PLC_POOL_READ_WRITE 1 /* everything */
#define PLC_POOL_MAKE 2       /* the same, and the pool is made if it is not there */

/* Opens the pool of that name; NULL is what PLCHOST_POOL in the environment says, else "plchost". Set-up. */
int plc_pool_open(const char* name, int access, plc_pool** pool);
/* Objects that were opened through it stay valid until they are closed themselves. Set-up. */
void plc_pool_close(plc_pool* pool);

#define PLC_POOL_KEEP 1u /* the object stays without references, until plc_pool_remove */

/* For an object that is made; where it is there already they count nothing. Fill it with zeros first. */
typedef struct {
  unsigned int size;  /* sizeof(plc_object_options) */
  unsigned int flags; /* PLC_POOL_KEEP */
  unsigned int mode;  /* permission bits as those of a file, 0660 say; 0: those of the pool */
  unsigned int group; /* number of the group that the mode speaks of, one that the caller is in; 0: that of
                         the pool, or the caller's own if he is not in it */
} plc_object_options;

/* The object is kept no longer: it goes now, or with its last reference. Set-up. */
int plc_pool_remove(plc_pool* pool, const char* name);

#define PLC_POOL_MEMORY 0u
#define PLC_POOL_SEMAPHORE 1u
#define PLC_POOL_EVENT 2u
#define PLC_POOL_MUTEX 3u

typedef struct {
  const char* name;
  unsigned int type;       /* PLC_POOL_MEMORY ... */
  unsigned int references; /* of all clients */
  unsigned int waiters;    /* threads that wait for it */
  unsigned int kept;
  plc_pool_u64 value; /* event: posts so far; semaphore: value; mutex: thread that holds it, 0: none */
  plc_pool_u64 size;  /* memory: bytes */
} plc_object_info;

/* Calls back for each object, which ends it early with another result than 0. The info is valid within the
 * call. How many there were, or a failure. Set-up. */
typedef int (*plc_pool_visitor)(const plc_object_info* info, void* user);
int plc_pool_list(plc_pool* pool, plc_pool_visitor visitor, void* user);

/* ---- Timeouts --------------------------------------------------------------------------------------------
 */

/* In nanoseconds from now; less than PLC_POOL_FOREVER, as "deadline - now" may be: the time is over. */
#define PLC_POOL_NO_WAIT 0L
#define PLC_POOL_FOREVER (-1L)

/* ---- Events ----------------------------------------------------------------------------------------------
 */

/* An event is a count of posts that only grows. Each waiter has a cursor of its own, so that each sees each
 * post, and a task that is bound to the event (stExternalEvent) runs once for each. */
int plc_event_create(plc_pool* pool, const char* name, const plc_object_options* options, plc_event** event);
int plc_event_open(plc_pool* pool, const char* name, int access, plc_event** event);
/* Any. */
int plc_event_post(plc_event* event);
/* Posts so far. Any. */
plc_pool_u64 plc_event_count(const plc_event* event);
/* Waits until there are more posts than *cursor, and sets it to how many there are. Begin with
 * plc_event_count(). PLC_POOL_TIMED_OUT: there were none. PLC_POOL_ARGUMENT: the cursor is ahead of them; it
 * is of another event, or was never set. An event that was opened with PLC_POOL_READ can be waited for; in a
 * pool that was, the wait looks for posts every millisecond. Any. */
int plc_event_wait(plc_event* event, plc_pool_u64* cursor, long timeout_ns);
void plc_event_close(plc_event* event);

/* ---- Semaphores ------------------------------------------------------------------------------------------
 */

#define PLC_POOL_MAX_VALUE 0x3fffffffu

/* A count that waits at 0. Units that a client took stay taken when it is killed: for exclusive use take a
 * mutex.
 */
int plc_semaphore_create(plc_pool* pool, const char* name, unsigned int value,
                         const plc_object_options* options, plc_semaphore** semaphore);
int plc_semaphore_open(plc_pool* pool, const char* name, int access, plc_semaphore** semaphore);
/* PLC_POOL_FULL: it is at PLC_POOL_MAX_VALUE. Any. */
int plc_semaphore_post(plc_semaphore* semaphore);
/* Any. */
int plc_semaphore_wait(plc_semaphore* semaphore, long timeout_ns);
unsigned int plc_semaphore_value(const plc_semaphore* semaphore);
void plc_semaphore_close(plc_semaphore* semaphore);

/* ---- Mutexes ---------------------------------------------------------------------------------------------
 */

/* Belongs to the thread that locked it, which inherits the priority of its waiters (not in a pool across
 * containers). If the thread or its process ends, the next one gets it and is told. */
int plc_mutex_create(plc_pool* pool, const char* name, const plc_object_options* options, plc_mutex** mutex);
int plc_mutex_open(plc_pool* pool, const char* name, plc_mutex** mutex);
/* PLC_POOL_OK or PLC_POOL_OWNER_DIED: locked. Any; the first lock of a thread reads a file. */
int plc_mutex_lock(plc_mutex* mutex, long timeout_ns);
/* Any. */
int plc_mutex_unlock(plc_mutex* mutex);
void plc_mutex_close(plc_mutex* mutex);

/* ---- Memories --------------------------------------------------------------------------------------------
 */

/* `size` bytes, zero when made. An image or a reference record that firmware has made with a header alone is
 * there already. PLC_POOL_REFUSED: also if a file is in the way that only another user or root can remove.
 * Users of one memory order their writes themselves. */
int plc_memory_create(plc_pool* pool, const char* name, size_t size, const plc_object_options* options,
                      plc_memory** memory);
/* With PLC_POOL_READ a write to it is a SIGSEGV. */
int plc_memory_open(plc_pool* pool, const char* name, int access, plc_memory** memory);
/* Where it is mapped, until it is closed; it may be at another address in each process. Any. */
void* plc_memory_address(const plc_memory* memory);
size_t plc_memory_size(const plc_memory* memory);
void plc_memory_close(plc_memory* memory);

#ifdef __cplusplus
}
#endif

#endif
