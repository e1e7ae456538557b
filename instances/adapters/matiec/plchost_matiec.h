/*
 * Between the two C files of an application that iec2c has translated: the one that `plcctl build
 * application` writes, in which the program and its types are, and application.c, which knows the runtime.
 * All names are in lower case: those of the program are in upper case, so none of them can be the same.
 */
#ifndef PLCHOST_MATIEC_H
#define PLCHOST_MATIEC_H

/* A located variable. Its value lies where the program has it, its bytes or its bit lie in an area. */
struct plchost_place {
  char area;           /* 'I', 'Q' or 'M' */
  unsigned char bytes; /* 1, 2, 4 or 8 */
  signed char bit;     /* 0 to 7; -1: whole bytes */
  unsigned int offset; /* of the first byte in the area */
  void* value;
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
  const unsigned int* uses;              /* places */
  unsigned long long* at_begin;          /* the value of each of them when the cycle began */
  const char* external_event;            /* each post runs it; null: none does */
  const struct plchost_options* options; /* null: the defaults */
};

/* From the file that plcctl writes. */
extern const char plchost_application_name[];
extern const unsigned int plchost_task_count;
extern const struct plchost_task plchost_tasks[];
extern const unsigned int plchost_place_count;
extern const struct plchost_place plchost_places[];
void config_init__(void);

/* From application.c: around each cycle of a task. */
void plchost_begin(unsigned int task);
void plchost_end(unsigned int task);

#endif
