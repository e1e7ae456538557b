/*
 * Variables that can be seen, written and forced from outside, a part of plc_app.h.
 *
 * An application declares each of them once, by name, in its plc_app_init. Then "plcctl list variables",
 * "read", "write", "force" and "watch" find it. A variable that is not declared is invisible. Declaring costs
 * memory of the control thread only: the cycle of a task is not longer, unless one of its variables is
 * forced.
 *
 *     static short speed;
 *     PLC_DECLARE_VARIABLE("Main.speed", PLC_TYPE_INT, speed);
 *
 * Order of a cycle: inputs, forces, code, forces, outputs. Writes are made between two cycles, when no task
 * is within one. A forced variable has the value that it was forced to at the begin of each cycle and at its
 * end; in between the code may write another one. Forces end with the process: also in a reset.
 *
 * Names. 1 to PLC_MAX_SYMBOL_NAME characters: words of letters, digits and _ with dots between them. They
 * are compared without regard to case, as in IEC 61131-3. Each dimension of an array is a "[]" in the name:
 * "Line.temperature[]" is an array, "Grid[][]" one of two dimensions, "Pump[].speed" a member of each
 * structure of an array. Its elements are "Line.temperature[3]", "Grid[1,2]", "Pump[2].speed".
 *
 * Programs. A read-only string whose area is "program" tells that a program has its name and that its text is
 * the type of the program. Its task runs the program, whose variables begin with the name and a dot. An
 * export of the plant has these programs.
 */
#ifndef PLC_VARIABLES_H
#define PLC_VARIABLES_H

#include "plc_app.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The elementary types of IEC 61131-3, with their bytes. */
#define PLC_TYPE_BOOL 1u           /* 1: 0 is FALSE, all else is TRUE */
#define PLC_TYPE_SINT 2u           /* 1 */
#define PLC_TYPE_INT 3u            /* 2 */
#define PLC_TYPE_DINT 4u           /* 4 */
#define PLC_TYPE_LINT 5u           /* 8 */
#define PLC_TYPE_USINT 6u          /* 1 */
#define PLC_TYPE_UINT 7u           /* 2 */
#define PLC_TYPE_UDINT 8u          /* 4 */
#define PLC_TYPE_ULINT 9u          /* 8 */
#define PLC_TYPE_BYTE 10u          /* 1 */
#define PLC_TYPE_WORD 11u          /* 2 */
#define PLC_TYPE_DWORD 12u         /* 4 */
#define PLC_TYPE_LWORD 13u         /* 8 */
#define PLC_TYPE_REAL 14u          /* 4 */
#define PLC_TYPE_LREAL 15u         /* 8 */
#define PLC_TYPE_TIME 16u          /* 8: nanoseconds, signed */
#define PLC_TYPE_DATE 17u          /* 8: nanoseconds since 1970 */
#define PLC_TYPE_TIME_OF_DAY 18u   /* 8: nanoseconds since midnight */
#define PLC_TYPE_DATE_AND_TIME 19u /* 8: nanoseconds since 1970 */
#define PLC_TYPE_STRING 20u        /* dwBytes of characters, ended by a zero */
/* Layouts of compilers. */
#define PLC_TYPE_TIMESPEC_TIME 21u          /* 16: long seconds, long nanoseconds */
#define PLC_TYPE_TIMESPEC_DATE 22u          /* 16: the same, since 1970 */
#define PLC_TYPE_TIMESPEC_TIME_OF_DAY 23u   /* 16: the same, since midnight */
#define PLC_TYPE_TIMESPEC_DATE_AND_TIME 24u /* 16: the same, since 1970 */
#define PLC_TYPE_COUNTED_STRING 25u         /* 1 byte: the length; then dwBytes - 1 of characters */
#define PLC_TYPE_SIZED_STRING 26u           /* characters, ended by a zero; the last 2 bytes: the length */
#define PLC_TYPE_DAYS_DATE 27u              /* 8: days since 1970, signed */
/* Of characters, added later. */
#define PLC_TYPE_CHAR 28u          /* 1 */
#define PLC_TYPE_WCHAR 29u         /* 2: a unit of UTF-16, char16_t */
#define PLC_TYPE_WSTRING 30u       /* dwBytes of units of UTF-16, ended by a zero */
#define PLC_TYPE_SIZED_WSTRING 31u /* the same; the last 2 bytes: the length in units */

#define PLC_MAX_DECLARED_VARIABLES 65536u
#define PLC_MAX_SYMBOL_NAME 250
#define PLC_MAX_DIMENSIONS 3
#define PLC_MAX_STRING 4096u /* bytes of a string's memory */

#define PLC_VARIABLE_READ_ONLY 1u /* it cannot be written or forced */

/* A dimension of an array. */
typedef struct {
  int nFirst;            /* index of its first element */
  unsigned int nCount;   /* elements, at least 1 */
  unsigned int dwStride; /* bytes from one to the next */
} Plc_Dimension;

/* Fill it with zeros first. */
typedef struct {
  unsigned int dwSize; /* sizeof(Plc_Variable) */
  const char* pszName;
  unsigned int dwType;  /* PLC_TYPE_..., of one element */
  unsigned int dwFlags; /* PLC_VARIABLE_..., or 0 */
  void* pAddress;       /* of the variable, or of an array's first element. It is valid until plc_app_exit */
  unsigned int dwBytes; /* strings: of one element's memory; others: 0, or that of the type */
  unsigned int nDimensions; /* as many as the name has "[]" */
  Plc_Dimension aDimensions[PLC_MAX_DIMENSIONS];
  const char* pszTask; /* the only task whose cycles use it; null: any */
  const char* pszArea; /* where it is mapped to, as "%QX0.1"; "retain"; "program": see above; null: nowhere */
} Plc_Variable;

/* Declares a variable. From plc_app_init only. ERR_OK; ERR_PARAMETER: null, dwSize, a name, type, size or
 * dimension that is not allowed (the log says which); ERR_DUPLICATE: one of that name; ERR_NOMEMORY: there
 * are PLC_MAX_DECLARED_VARIABLES; ERR_NOTINITIALIZED. A task that is not there, and an address that is none
 * of this process, are reported by the runtime after plc_app_init has returned. Control. */
RTS_RESULT CDECL plc_declare_variable(const Plc_Variable* pVariable);

/* Gives the forced variables of the task whose cycle runs on this thread their values. The runtime does that
 * by itself before and after the task's function. An application that takes inputs or puts outputs out within
 * that function calls it behind the one and before the other. Any, real-time. */
void CDECL plc_apply_forces(void);

/* The macros declare a variable that any task may use. The log says why one is refused. */
#define PLC_DECLARE_VARIABLE_(name, type, address, bytes, dimensions, first, count, stride) \
  do {                                                                                      \
    static Plc_Variable plc_declared_; /* all else is zero */                               \
    plc_declared_.dwSize = sizeof(Plc_Variable);                                            \
    plc_declared_.pszName = (name);                                                         \
    plc_declared_.dwType = (type);                                                          \
    plc_declared_.pAddress = (address);                                                     \
    plc_declared_.dwBytes = (bytes);                                                        \
    plc_declared_.nDimensions = (dimensions);                                               \
    plc_declared_.aDimensions[0].nFirst = (first);                                          \
    plc_declared_.aDimensions[0].nCount = (count);                                          \
    plc_declared_.aDimensions[0].dwStride = (stride);                                       \
    plc_declare_variable(&plc_declared_);                                                   \
  } while (0)

/* A variable that is no array and no string. */
#define PLC_DECLARE_VARIABLE(name, type, variable) \
  PLC_DECLARE_VARIABLE_(name, type, &(variable), 0, 0, 0, 0, 0)

/* An array of one dimension whose elements are no strings: PLC_DECLARE_ARRAY("Line.speed[]", PLC_TYPE_INT,
 * speed, 1) is "Line.speed[1]" and those behind it. */
#define PLC_DECLARE_ARRAY(name, type, array, first)                            \
  PLC_DECLARE_VARIABLE_(name, type, &(array)[0], sizeof((array)[0]), 1, first, \
                        sizeof(array) / sizeof((array)[0]), sizeof((array)[0]))

/* An array of characters, whose text is ended by a zero. */
#define PLC_DECLARE_STRING(name, characters) \
  PLC_DECLARE_VARIABLE_(name, PLC_TYPE_STRING, &(characters)[0], sizeof(characters), 0, 0, 0, 0)

/* An array of char16_t (of <uchar.h> in C), whose text in UTF-16 is ended by a zero. */
#define PLC_DECLARE_WSTRING(name, units) \
  PLC_DECLARE_VARIABLE_(name, PLC_TYPE_WSTRING, &(units)[0], sizeof(units), 0, 0, 0, 0)

#ifdef __cplusplus
}
#endif

#endif
