/*
 * Between the files of an application that a compiler for IEC 61131-3 has translated. One file has the
 * program and its types: `plcctl build application` writes it, in C or C++. The others know the runtime:
 * application.c, copies.c, places.c, symbols.c and variables.c. All names are in lower case: those of the
 * program are in upper case, so none of them can be the same.
 */
#ifndef PLCHOST_ADAPTER_H
#define PLCHOST_ADAPTER_H

#include "plchost_once.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A located variable. Its value lies where the program has it, its bytes or its bit lie in an area. */
struct plchost_place {
  const char* name;
  char area;             /* 'I', 'Q' or 'M' */
  unsigned char bytes;   /* 1, 2, 4 or 8 */
  signed char bit;       /* 0 to 7; -1: whole bytes */
  unsigned char aliased; /* 1: another place has some of the same bits */
  unsigned int offset;   /* of the first byte in the area */
  void* value;
};

/* A location of the program, whose place a task file may choose. An online change is refused if both versions
 * have it at different ones. */
struct plchost_location {
  const char* name;
  unsigned int layout; /* the first bit of its place, plus 1 */
};

/* A place that a task exchanges with its area. */
struct plchost_use {
  unsigned int place;
  void* value;               /* that of the place, or one of this task alone */
  unsigned char others;      /* 1: only other tasks use it. It has bits in a byte that this one puts out */
  unsigned int next;         /* of those that share bits: the next one in their ring */
  unsigned long long before; /* the value at the begin of the cycle */
  unsigned long long seen;   /* that when all of the ring were one memory last */
};

/* Options that IEC 61131-3 does not have; the ranges are those of Task_Options in plc_app.h. */
struct plchost_options {
  long start_offset_ns;
  short late_policy; /* PLC_LATE_... */
  unsigned char drives_outputs;
  unsigned int watchdog_time_us;
  unsigned int watchdog_sensitivity;
  unsigned int watchdog_omitted_cycles;
  short watchdog_policy; /* PLC_WATCHDOG_... */
};

struct plchost_task {
  const char* name;
  short priority;
  long interval_ns;            /* 0: not cyclic */
  unsigned char (*edge)(void); /* of SINGLE; null: it has none */
  void (*run)(void);
  unsigned int uses_count;
  struct plchost_use* uses;
  unsigned int retained_count;
  const unsigned int* retained;          /* numbers among the retained variables */
  const char* external_event;            /* each post runs it; null: none does */
  const struct plchost_options* options; /* null: the defaults */
  unsigned int sharing_count; /* so many of the first uses share bits. The widest one comes first */
};

/* A variable that is not located. */
struct plchost_variable {
  const char* path;
  void* value;
  unsigned int bytes;
  unsigned long long layout; /* another one if its type is another one */
  int retain;
};

/* A global of which a program has a copy. */
struct plchost_copy {
  void* global;
  void* copy;
  void* before; /* the copy as it was taken */
  unsigned int bytes;
  unsigned int piece; /* bytes that are exchanged at a time: of an array those of an element */
  /* Calls `work` while no task uses the global; null: the globals of the compiler have no locks. */
  void (*locked)(const struct plchost_copy* copy, void (*work)(const struct plchost_copy* copy));
};

/* A variable that can be seen from outside, as in plc_variables.h. */
struct plchost_symbol {
  const char* name;
  unsigned int type; /* PLC_TYPE_... */
  void* value;
  unsigned int bytes; /* of one element */
  unsigned int read_only;
  unsigned int dimensions;
  struct {
    int first;
    unsigned int count;
    unsigned int stride;
  } dimension[3];
  const char* task; /* null: several */
  const char* area; /* null: it is not located */
};

/* A program that a task runs. */
struct plchost_program {
  const char* name;
  const char* type;
  const char* task;
};

/* From the file that plcctl writes. */
extern const char plchost_application_name[];
extern const char plchost_scheduler[]; /* that it is made for; empty: any */
extern const unsigned int plchost_task_count;
extern const struct plchost_task plchost_tasks[];
extern const unsigned int plchost_program_count;
extern const struct plchost_program plchost_programs[];
extern const unsigned int plchost_place_count;
extern const struct plchost_place plchost_places[];
extern unsigned long long plchost_exchanged[]; /* for each place, not in the inputs */
extern const unsigned int plchost_location_count;
extern const struct plchost_location plchost_locations[];
void plchost_each_variable(void (*use)(const struct plchost_variable*));
void plchost_each_symbol(void (*use)(const struct plchost_symbol*));
void plchost_bind(void); /* makes the program ready for its first cycle */

/* From application.c: around each cycle of a task. */
void plchost_begin(unsigned int task);
void plchost_end(unsigned int task);
/* 1: a fault or a watchdog has stopped it within its cycle. Any thread. */
int plchost_is_stopped(unsigned int task);
/* An assignment by the task that runs on this thread: `now` has the bytes of the value. 0: it is of no place
 * that shares bits with others of the task, and nothing is done. */
int plchost_assign(void* value, const void* now);

/* From copies.c: around the code of a program. Preparing returns 0 if it fails. */
int plchost_prepare_copies(void);
void plchost_forget_copies(void);
void plchost_take_copies(const struct plchost_copy* copies, unsigned int count);
void plchost_put_copies(const struct plchost_copy* copies, unsigned int count);

/* From places.c. Declaring returns 0 if that fails. */
int plchost_declare_places(void);
void plchost_forget_places(void);
void plchost_take_places(const struct plchost_task* task);
void plchost_put_places(const struct plchost_task* task);
/* Places that share bits are one memory again, after something else than an assignment has changed some of
 * them. 1: some were not. */
int plchost_settle_places(const struct plchost_task* task);
int plchost_settle_forced_places(const struct plchost_task* task);
/* As plchost_assign(). */
int plchost_assign_place(const struct plchost_task* task, void* value, const void* now);
/* The bit of a place in the memory area as it is now. Any thread. */
unsigned char plchost_bit_now(unsigned int place);

/* From symbols.c: variables and programs. Returns 0 if that fails. */
int plchost_declare_symbols(void);

/* From variables.c. */
int plchost_declare_variables(void);
void plchost_forget_variables(void);
/* Whether that byte is one of a retained variable. After they were declared. */
int plchost_is_retained(const void* value);
void plchost_keep_retained(const struct plchost_task* task);

#ifdef __cplusplus
}
#endif

#endif
