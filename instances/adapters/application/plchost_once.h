/*
 * PLCHOST_ONCE: of functions that run once, with a line for each variable of the program. The compiler does
 * not optimise them: that takes minutes with 10,000 variables.
 */
#ifndef PLCHOST_ONCE_H
#define PLCHOST_ONCE_H

#ifdef __clang__
#define PLCHOST_ONCE __attribute__((optnone, noinline))
#else
#define PLCHOST_ONCE __attribute__((optimize("O0"), noinline))
#endif

#endif
