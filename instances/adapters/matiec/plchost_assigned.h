/*
 * Assignments of a program whose located variables share bits. The code of iec2c assigns by these macros of
 * its library, of which the program includes this one first.
 */
#ifndef PLCHOST_ASSIGNED_H
#define PLCHOST_ASSIGNED_H

#include "accessor.h"

/* Once, also if an index is in it. The value may have commas: a text. */
#define PLCHOST_ASSIGN(variable, ...)                                         \
  {                                                                           \
    __typeof__(variable)* const plchost_at = &(variable);                     \
    const __typeof__(variable) plchost_new = __VA_ARGS__;                     \
    if (!plchost_assign(plchost_at, &plchost_new)) *plchost_at = plchost_new; \
  }

#undef __SET_LOCATED
#define __SET_LOCATED(prefix, name, suffix, new_value) \
  if (!(prefix name.flags & __IEC_FORCE_FLAG)) PLCHOST_ASSIGN((*(prefix name.value))suffix, new_value)
#undef __SET_EXTERNAL
#define __SET_EXTERNAL(prefix, name, suffix, new_value)                           \
  {                                                                               \
    extern IEC_BYTE __IS_GLOBAL_##name##_FORCED(void);                            \
    if (!(prefix name.flags & __IEC_FORCE_FLAG || __IS_GLOBAL_##name##_FORCED())) \
      PLCHOST_ASSIGN((*(prefix name.value))suffix, new_value)                     \
  }

#endif
