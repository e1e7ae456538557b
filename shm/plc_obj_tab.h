/*
 * The object table of the seed ("Global object pools", vxworks_specific), for firmware that walks it by hand:
 * the same names and layout, as this process sees the pool. Firmware that was written for it compiles with
 * this header in the place of the old one, and is linked with -lplcpool:
 *
 *     semTake(g_PlcObjTab->hSem, WAIT_FOREVER);
 *     for (i = 0; i < g_PlcObjTab->ulSize; ++i)
 *       if (strcmp(g_PlcObjTab->ptEntries[i].pszName, "line1/outputs") == 0) ...
 *     semGive(g_PlcObjTab->hSem);
 *
 * The pool is the one that PLCHOST_POOL in the environment names, else "plchost". The table is brought up to
 * date each time that g_PlcObjTab is read, but not while this thread holds hSem. Each entry is opened in this
 * process, so that its address and handles can be used. An object that nobody else needs any more leaves the
 * table. All of it is set-up; of the functions only semTake and semGive on an entry may be used in a cycle.
 *
 * New firmware better uses plc_pool.h, which opens only what it asks for by name.
 */
#ifndef PLC_OBJ_TAB_H
#define PLC_OBJ_TAB_H

#ifdef __cplusplus
extern "C" {
#endif

#define OBJTAB_VERSION 0x00000001

typedef struct plc_sem* SEM_ID;
typedef int STATUS;
#ifndef OK
#define OK 0
#endif
#ifndef ERROR
#define ERROR (-1)
#endif
#ifndef NO_WAIT
#define NO_WAIT 0
#endif
#ifndef WAIT_FOREVER
#define WAIT_FOREVER (-1)
#endif

/* A mutex of the pool is an e_sem, too. */
typedef enum objTabType_e { e_shm, e_sem, e_evt } objTabType_t;

typedef struct shmEntry_s {
  unsigned long ulAddress; /* in this process; 0: its rights do not allow this process to map it */
  unsigned long ulSize;    /* bytes */
} shmEntry_t;

typedef struct semEntry_s {
  SEM_ID hSem; /* NULL: its rights do not allow it */
} semEntry_t;

typedef struct evtEntry_s {
  SEM_ID hEvt; /* semGive posts; semTake waits for a post that this process has not taken yet */
} evtEntry_t;

typedef struct objEntry_s {
  objTabType_t tType;
  char* pszName;
  union {
    shmEntry_t tShmEntry;
    semEntry_t tSemEntry;
    evtEntry_t tEvtEntry;
  } u;
} objEntry_t;

typedef struct objTab_s {
  unsigned long ulVersion; /* OBJTAB_VERSION */
  SEM_ID hSem;             /* guards this process's table among its threads */
  objEntry_t* ptEntries;
  unsigned long ulSize;   /* entries */
  unsigned long ulRefCnt; /* 1: this process */
} objTab_t;

/* NULL: there is no such pool, or it cannot be listed; plc_pool_error() of plc_pool.h says why. A child of
 * fork() gets a table of its own: it looks up anew all that it had of its parent's. */
objTab_t* plc_obj_tab(void);
#define g_PlcObjTab (plc_obj_tab())

/* `timeout` in ticks of 1 ms, NO_WAIT or WAIT_FOREVER. ERROR: timed out, or not possible; of a mutex whose
 * owner died it is OK. */
STATUS semTake(SEM_ID semId, int timeout);
STATUS semGive(SEM_ID semId);

#ifdef __cplusplus
}
#endif

#endif
