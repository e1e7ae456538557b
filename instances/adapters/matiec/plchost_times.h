/*
 * Times and dates for the programs of MATIEC. Its own library is wrong without a word: T#1ms has 999999 ns.
 * There T#500ms + T#500ms is not T#1s, T#900ms * 3 does not fit, and dates end in 2038. This is a part of
 * plchost_library.h, which includes it between the two halves of that library.
 */
#ifndef PLCHOST_TIMES_H
#define PLCHOST_TIMES_H

#define PLCHOST_NS_OF_S 1000000000LL

/* A constant in C, as initial values need one. Rounded: the parts are values of C's double. */
#define plchost_ns(sign, milliseconds, seconds, minutes, hours, days)                                    \
  (((sign) >= 0 ? 1 : -1) *                                                                              \
   (long long)(((((long double)(days) * 24 + (hours)) * 60 + (minutes)) * 60 + (long double)(seconds)) * \
                   1e9L +                                                                                \
               (long double)(milliseconds) * 1e6L + 0.5L))
#undef __time_to_timespec
#define __time_to_timespec(sign, milliseconds, seconds, minutes, hours, days)                      \
  ((IEC_TIMESPEC){plchost_ns(sign, milliseconds, seconds, minutes, hours, days) / PLCHOST_NS_OF_S, \
                  plchost_ns(sign, milliseconds, seconds, minutes, hours, days) % PLCHOST_NS_OF_S})
#undef __tod_to_timespec
#define __tod_to_timespec(seconds, minutes, hours) __time_to_timespec(1, 0, seconds, minutes, hours, 0)

/* Both parts have the same sign, and less than a second is in tv_nsec. */
static inline IEC_TIMESPEC plchost_time_of(LINT seconds, LINT nanoseconds) {
  seconds += nanoseconds / PLCHOST_NS_OF_S;
  nanoseconds %= PLCHOST_NS_OF_S;
  if (seconds > 0 && nanoseconds < 0) {
    --seconds;
    nanoseconds += PLCHOST_NS_OF_S;
  } else if (seconds < 0 && nanoseconds > 0) {
    ++seconds;
    nanoseconds -= PLCHOST_NS_OF_S;
  }
  return (IEC_TIMESPEC){seconds, nanoseconds};
}

static inline TIME plchost_time_add(TIME one, TIME other) {
  return plchost_time_of(one.tv_sec + other.tv_sec, one.tv_nsec + other.tv_nsec);
}
#define __time_add plchost_time_add
static inline TIME plchost_time_sub(TIME one, TIME other) {
  return plchost_time_of(one.tv_sec - other.tv_sec, one.tv_nsec - other.tv_nsec);
}
#define __time_sub plchost_time_sub

/* Rounded to a nanosecond. */
static inline TIME plchost_time_of_seconds(long double seconds) {
  const long double ns = seconds * PLCHOST_NS_OF_S;
  if (!(ns > -9.2e18L && ns < 9.2e18L)) plchost_runtime_error();
  return plchost_time_of(0, (LINT)(ns < 0 ? ns - 0.5L : ns + 0.5L));
}
static inline long double plchost_seconds(TIME time) {
  return time.tv_sec + (long double)time.tv_nsec / PLCHOST_NS_OF_S;
}
static inline TIME plchost_time_mul(TIME time, LREAL factor) {
  return plchost_time_of_seconds(plchost_seconds(time) * factor);
}
#define __time_mul plchost_time_mul
static inline TIME plchost_time_div(TIME time, LREAL divisor) {
  return plchost_time_of_seconds(plchost_seconds(time) / divisor);
}
#define __time_div plchost_time_div
static inline TIME plchost_real_to_time(LREAL seconds) {
  return plchost_time_of_seconds(seconds);
}
#define __real_to_time plchost_real_to_time

static inline IEC_TIMESPEC plchost_date(int day, int month, int year) {
  LINT years, days;
  if (month < 1 || month > 12 || day < 1 ||
      day > __mon_yday[__isleap(year)][month] - __mon_yday[__isleap(year)][month - 1])
    plchost_runtime_error();
  years = year - 1; /* those that are over */
  days =
      years * 365 + years / 4 - years / 100 + years / 400 + __mon_yday[__isleap(year)][month - 1] + day - 1;
  return (IEC_TIMESPEC){(days - 719162) * SECONDS_PER_DAY, 0}; /* 719162 of them before 1970 */
}
#define __date_to_timespec plchost_date
static inline IEC_TIMESPEC plchost_date_and_time(double seconds, double minutes, double hours, int day,
                                                 int month, int year) {
  const IEC_TIMESPEC time = __tod_to_timespec(seconds, minutes, hours);
  return plchost_time_of(plchost_date(day, month, year).tv_sec + time.tv_sec, time.tv_nsec);
}
#define __dt_to_timespec plchost_date_and_time

#endif
