/*
 * MATIEC's library for C, with parts that suit a host. The C files of a program include it first; its own
 * include of the library then does nothing.
 */
#ifndef PLCHOST_LIBRARY_H
#define PLCHOST_LIBRARY_H

#include <stdio.h>
#include <stdlib.h>

#include "plchost_once.h"

void plc_log(int nLevel, const char* pszText); /* of plc_app.h, whose other names the program may have */

/* A time or a date is out of range. The library prints, and goes on with a wrong value, or reads
 * beyond a table. Here the task gets an exception instead: nothing prints in a cycle. */
_Noreturn static inline void plchost_runtime_error(void) {
  plc_log(2, "IEC runtime error: a time, a date or a time of day is out of range");
  abort();
}

#define fprintf(...) plchost_runtime_error()
/* Its last lines include the functions and function blocks, which are to use other times. Their order counts.
 */
#define _IEC_STD_FUNCTIONS_H
#define _IEC_STD_FB_H
// clang-format off
#include "iec_std_lib.h"
#undef _IEC_STD_FUNCTIONS_H
#undef _IEC_STD_FB_H
#include "plchost_times.h"
#include "iec_std_functions.h"
#include "iec_std_FB.h"
#include "plchost_texts.h"
// clang-format on
#undef fprintf

/* The timers' clock begins when the machine does. RTC shows the date (UTC) while IN is FALSE. When IN rises,
 * it goes on from PDT, by the timers' clock, so that a clock that is set does not disturb it. */
static void plchost_rtc_body__(RTC* data__) {
  struct timespec date;
  IEC_TIMESPEC shown;
  RTC_body__(data__);
  if (__GET_VAR(data__->IN, ) || !__GET_VAR(data__->ENO, )) return;
  clock_gettime(CLOCK_REALTIME, &date);
  shown.tv_sec = date.tv_sec;
  shown.tv_nsec = date.tv_nsec;
  __SET_VAR(data__->, CDT, , shown);
}
#define RTC_body__ plchost_rtc_body__

/* Of MATIEC's runtimes, for the C in pragmas: __tick times common_ticktime__ is the time in ns, which is the
 * clock of the task's cycle here. A pragma may declare it: extern unsigned long __tick; */
extern unsigned long long common_ticktime__;
unsigned long* plchost_ticks(unsigned long long tick_ns);
static inline unsigned long* plchost_tick(void) {
  return plchost_ticks(common_ticktime__);
}
#define __tick (*plchost_tick())

/* iec2c has the greatest common divisor of all intervals in it. Programs divide it by a millisecond. */
static inline void plchost_set_ticktime(void) {
  const unsigned long long ms = 1000000;
  if (common_ticktime__ == 0 || common_ticktime__ % ms != 0) common_ticktime__ = ms;
}

/* reference^ := value */
#define PLCHOST_SET_REFERENCE(reference, ...) (*(reference) = (__VA_ARGS__))

#endif
