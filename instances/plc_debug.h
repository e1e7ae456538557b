/*
 * Statements that a debugger can halt at, a part of plc_app.h.
 *
 * Only debug builds use it: "plcctl build application --debug", or a program of C or C++ that has these
 * macros in it. A program without them costs nothing and cannot be halted. A program with them is a debug
 * build, which the manager refuses where its configuration says "allow_debug = false".
 *
 *     static const unsigned int lines[] = {12, 13};
 *     static Plc_Pou main_pou = {sizeof(Plc_Pou), "Main", "main.st", lines, 2, 0, 0, 0, 0, 0};
 *
 *     static void main_body(struct Main* self) {
 *       PLC_ENTER(main_pou, self);
 *       PLC_STATEMENT(12);
 *       self->count += 1;
 *       PLC_STATEMENT(13);
 *       ...
 *     }
 *
 * The variables at `self` are seen by the names that plc_debug_declare_instance and plc_declare_variable give
 * them. Others that lie on the stack, as those of a function do, are declared with the POU:
 *
 *     static const Plc_Local locals[] = {{"x", PLC_TYPE_INT, 0, 0, 0}, {"sum", PLC_TYPE_DINT, 0, 0, 0}};
 *     static Plc_Pou add_pou = {sizeof(Plc_Pou), "Add", "main.st", add_lines, 1, 0, locals, 2, 0, 0};
 *
 *     static int add(short x) {
 *       int sum = 0;
 *       void* const addresses[] = {&x, &sum};
 *       PLC_ENTER_LOCALS(add_pou, 0, addresses, 0);
 *       ...
 *
 * An array among them has a "[]" in its name for each dimension. Its address is that of its first element,
 * and a row in pArrays of the POU tells its dimensions:
 *
 *     {"cells[]", PLC_TYPE_INT, 0, 0, 0}  and  {2, 1, {{1, 8, sizeof(short)}}}   if it has number 2
 *
 * A statement costs one store and one test of a word as long as nobody debugs. Only the thread of the task
 * that comes to a breakpoint halts; it needs no signal, no right and no other process.
 */
#ifndef PLC_DEBUG_H
#define PLC_DEBUG_H

#include "plc_app.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PLC_MAX_POUS 4096u
#define PLC_MAX_POU_INSTANCES 65536u
#define PLC_MAX_POU_LINES 65536u /* of one POU */
#define PLC_MAX_POU_LOCALS 1024u /* of one POU */

/* A variable that each call has for itself: a parameter, a local variable, the result of a function. */
typedef struct {
  const char* pszName;  /* as that of a declared variable */
  unsigned int dwType;  /* PLC_TYPE_... of plc_variables.h */
  unsigned int dwBytes; /* strings: of its memory; others: 0 */
  unsigned int
      dwFirstLine; /* the first and last line of the statements that it is there for. Several methods */
  unsigned int dwLastLine; /* of a POU may have variables of one name. Both 0: it is there for all */
} Plc_Local;

/* The dimensions of a local variable that is an array. */
typedef struct {
  unsigned int dwLocal;     /* its number in pLocals */
  unsigned int nDimensions; /* as many as its name has "[]" */
  Plc_Dimension aDimensions[PLC_MAX_DIMENSIONS];
} Plc_LocalArray;

/* A program, function block or function. It is there until plc_app_exit. */
typedef struct {
  unsigned int dwSize;           /* sizeof(Plc_Pou) */
  const char* pszName;           /* 1 to 63 letters, digits and _ */
  const char* pszFile;           /* the source file, as the user calls it: 1 to 255 characters */
  const unsigned int* pdwLines;  /* the lines at which a statement begins, ascending, each once */
  unsigned int nLines;           /* 1 to PLC_MAX_POU_LINES */
  unsigned int dwNumber;         /* the runtime's */
  const Plc_Local* pLocals;      /* null: none */
  unsigned int nLocals;          /* 0 to PLC_MAX_POU_LOCALS */
  const Plc_LocalArray* pArrays; /* null: none. dwSize of a build without these two ends here */
  unsigned int nArrays;
} Plc_Pou;

/* A call of a POU that has not returned: made by PLC_ENTER or PLC_ENTER_LOCALS on the stack of the thread. */
typedef struct Plc_Frame {
  const Plc_Pou* pPou;
  const void* pSelf;         /* the variables of a program or function block; null: a function */
  unsigned int dwLine;       /* the statement that it is at; 0: none yet */
  unsigned int dwDepth;      /* calls below it, the runtime's */
  struct Plc_Frame* pCaller; /* null: it is the first */
  void* const* ppLocals;     /* where the local variables of this call are; null for one: it is not seen */
  unsigned int dwFirstLocal; /* the number in pLocals of the first of them */
  unsigned int nLocals;
} Plc_Frame;

/* Declares a POU. From plc_app_init only. ERR_OK; ERR_PARAMETER: null, dwSize, a name, file, line or local
 * variable that is not allowed (the log says which); ERR_DUPLICATE: one of that name; ERR_NOMEMORY: there are
 * PLC_MAX_POUS; ERR_NOTINITIALIZED. Control. */
RTS_RESULT CDECL plc_debug_declare_pou(Plc_Pou* pPou);

/* Says that the variables at pSelf are that program or function block, and how the names of its variables
 * begin: "Main.motor" if they are "Main.motor.speed" and others. From plc_app_init, behind
 * plc_debug_declare_pou. Results as above. Control. */
RTS_RESULT CDECL plc_debug_declare_instance(const Plc_Pou* pPou, const void* pSelf, const char* pszPath);

/* The macros use the rest. Any thread, real-time. */
extern unsigned int plc_debug_armed;
void CDECL plc_debug_enter(Plc_Frame* pFrame);
void CDECL plc_debug_leave(Plc_Frame* pFrame);
void CDECL plc_debug_statement(Plc_Frame* pFrame);

/* The first statement of the code of a POU. */
#define PLC_ENTER(pou, self)                                                                           \
  Plc_Frame plc_frame_ __attribute__((cleanup(plc_debug_leave))) = {&(pou), (self), 0, 0, 0, 0, 0, 0}; \
  plc_debug_enter(&plc_frame_)

/* The same in code with local variables. `addresses`: an array of them, of type void* const. `first`: the
 * number in pLocals of the first; they are in its order. */
#define PLC_ENTER_LOCALS(pou, self, addresses, first)                                             \
  Plc_Frame plc_frame_ __attribute__((cleanup(plc_debug_leave))) = {                              \
      &(pou), (self), 0, 0, 0, (addresses), (first), sizeof(addresses) / sizeof((addresses)[0])}; \
  plc_debug_enter(&plc_frame_)

/* Before the statement of that line. */
#define PLC_STATEMENT(line)                                                            \
  do {                                                                                 \
    plc_frame_.dwLine = (line);                                                        \
    if (__builtin_expect(__atomic_load_n(&plc_debug_armed, __ATOMIC_RELAXED) != 0, 0)) \
      plc_debug_statement(&plc_frame_);                                                \
  } while (0)

#ifdef __cplusplus
}
#endif

#endif
