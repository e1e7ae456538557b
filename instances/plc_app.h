/*
 * The contract between plc-instance and an application (the program of the user) or a component: plain C89,
 * no library to link. An application is one shared object that exports
 *
 * - plc_app_abi: PLC_APP_ABI_VERSION, checked before anything of it runs. Write PLC_EXPORT_ABI.
 * - int plc_app_init(void): called once after loading. It calls __sys__setup__tasks(), and 0 means success.
 * - void plc_app_exit(void), optional: called once when all tasks have ended, or when another version of the
 *   program has taken over from this one (see "Online change" below). It is also called when the runtime
 *   refuses the program after its plc_app_init; then areas have no addresses.
 *
 * It calls the functions of the runtime that are declared below; they are found when it is loaded.
 *
 *     gcc -std=c89 -shared -fPIC -I FOLDER_OF_THIS_FILE -o my.so my.c
 *     plc-instance --check-application my.so
 *
 * Thread contexts: "control" is the runtime's one soft thread, on which plc_app_init, plc_app_exit, the hooks
 * of components and the callbacks run. The context "any" includes the cycle of a real-time task: such a
 * function takes no lock, does no allocation and no input or output.
 */
#ifndef PLC_APP_H
#define PLC_APP_H

#ifdef __cplusplus
extern "C" {
#endif

/* Grows when a program that was built with an older file could not run any more. */
#define PLC_APP_ABI_VERSION 1u

#define CDECL
#define PLC_EXPORT __attribute__((visibility("default")))

/* The functions that a program must export. */
PLC_EXPORT extern const unsigned int plc_app_abi;
PLC_EXPORT int CDECL plc_app_init(void);
PLC_EXPORT void CDECL plc_app_exit(void);

/* Write it once, in one file of the application or component, with a semicolon behind it. */
#define PLC_EXPORT_ABI const unsigned int plc_app_abi = PLC_APP_ABI_VERSION

/* ---- Handles and results ------------------------------------------------------------------------------- */

typedef void* RTS_HANDLE;
#ifdef __cplusplus
#define RTS_INVALID_HANDLE (reinterpret_cast<RTS_HANDLE>(-1L))
#else
#define RTS_INVALID_HANDLE ((RTS_HANDLE)(-1L))
#endif

typedef unsigned int RTS_RESULT;
#define ERR_OK 0x0000u
#define ERR_FAILED 0x0001u
#define ERR_PARAMETER 0x0002u /* not a handle or name of the allowed form */
#define ERR_NOTINITIALIZED \
  0x0003u                      /* there is no runtime around this call, or it is not on the control thread */
#define ERR_NOBUFFER 0x0006u   /* congestion: the queue to the next node is full, nothing was sent */
#define ERR_PENDING 0x000Au    /* the link to the next node is being made: send again in the next cycle */
#define ERR_BUFFERSIZE 0x000Fu /* the buffer is too small; the block waits for a larger one */
#define ERR_NO_OBJECT \
  0x0010u /* the event is not registered: nothing was counted; or: there is no such thing */
#define ERR_NOMEMORY 0x0011u  /* a table or the object pool has no room */
#define ERR_DUPLICATE 0x0012u /* was there already; the handle is valid */
#define ERR_NO_TASK 0x4000u   /* soft: counted, but no task is bound to the event at this time */

typedef long RTS_I64; /* 64 bit */
typedef unsigned long RTS_UI64;

/* ---- Tasks --------------------------------------------------------------------------------------------- */

#define Cyclic 0x0000       /* runs every dwInterval */
#define Event 0x0001        /* runs once each time its BOOL goes from FALSE to TRUE */
#define External 0x0002     /* runs once for each post of the external event stExternalEvent */
#define Freewheeling 0x0003 /* runs in a loop and sleeps a share of its execution time in between */

/* The value of a BOOL: 0 is FALSE, all else is TRUE. Called by the scheduler, often: only reads. */
typedef unsigned char(CDECL* PLC_EVENT_FUNCTION)(void);
/* One cycle of a task. */
typedef void(CDECL* PLC_TASK_FUNCTION)(void);

/*
 * One task. The names and their order are those of the seed; only the function pointers are real ones (64
 * bit). The runtime writes the t... fields after each cycle, all in microseconds, so it must not be const.
 * Cycle time is the execution time of one cycle. Jitter is (start - start before) - interval, signed;
 * tJitterMax is the one of largest magnitude; both stay 0 unless the task is cyclic. A value that does not
 * fit is cut to the nearest int. tLastCycleTime is -1 when a fault or a watchdog has stopped the task alone.
 *
 * The functions have no argument. Data of one task are kept in static variables of its function. If several
 * tasks share a function, plc_current_task() tells them apart.
 */
typedef struct {
  char stName[51];                           /* letters, digits, '_', '-', '.'; unique in the application */
  short nPriority;                           /* 0 (highest) to 31; 0..15 are real-time, 16..31 are not */
  short KindOfTask;                          /* Cyclic, Event, External or Freewheeling */
  char bMicroseconds;                        /* unit of dwInterval: 0 milliseconds, 1 microseconds */
  unsigned int dwInterval;                   /* cyclic: greater than 0; other kinds: not used */
  PLC_EVENT_FUNCTION dwEventFunctionPointer; /* event: reads the BOOL; other kinds: not used */
  char stExternalEvent[51];                  /* external: the event's name; other kinds: not used */
  PLC_TASK_FUNCTION dwTaskEntryFunctionPointer;
  int tLastCycleTime;
  int tAverageCycleTime;
  int tMaxCycleTime;
  int tMinCycleTime;
  int tJitterMax;
  int tJitterLast;
} Task_Info;

#define PLC_MAX_TASKS 1024

typedef struct {
  short nTasks; /* 1 to PLC_MAX_TASKS */
  char stApplicationName[51];
  Task_Info* ptaskinfo; /* nTasks of them; they live as long as the application */
} sys_setup_tasks_struct;

/* Hands the task configuration over. Once, from plc_app_init. The runtime reports its faults, with the task's
 * name, after plc_app_init has returned. Control. */
void CDECL __sys__setup__tasks(sys_setup_tasks_struct* p);

/* Of releases that passed while a cyclic task was busy. A cycle that is woken late begins at once anyway. */
#define PLC_LATE_NEXT 0 /* all are lost: it waits for the next point of its grid */
#define PLC_LATE_ASAP 1 /* it runs at once for the last of them */

#define PLC_WATCHDOG_APPLICATION 0 /* a hit puts the whole application into exception */
#define PLC_WATCHDOG_TASK 1        /* a hit puts only the task into exception */

/* The options for which the seed's Task_Info has no place. Fill it with zeros first: zero is the default
 * everywhere. */
typedef struct {
  unsigned int dwSize;    /* sizeof(Task_Options) */
  RTS_I64 nStartOffsetNs; /* cyclic: 0 to below the interval; where in its period the task is released */
  short nLatePolicy;      /* cyclic: PLC_LATE_NEXT or PLC_LATE_ASAP */
  unsigned char bDrivesOutputs;         /* 1: the task is stopped in the first phase of a stop */
  unsigned int dwWatchdogTimeUs;        /* microseconds that a cycle may take; 0: no watchdog of its own */
  unsigned int dwWatchdogSensitivity;   /* 0 (as 1) to 1000000 */
  unsigned int dwWatchdogOmittedCycles; /* releases in a row that may not be missed, to 1000000; 0: off */
  short nWatchdogPolicy;                /* PLC_WATCHDOG_APPLICATION or PLC_WATCHDOG_TASK */
} Task_Options;

/* Sets the options of a task, before or after __sys__setup__tasks() names it. From plc_app_init only. A
 * section [Task.NAME] of the settings wins over what is given here. ERR_OK; ERR_PARAMETER: null, no name of a
 * task, another dwSize, or a value that is not allowed (the log names it); ERR_DUPLICATE: given already for
 * this task; ERR_NOTINITIALIZED. A task that is not there, or not cyclic where it has to be, is reported by
 * the runtime after plc_app_init has returned. Control. */
RTS_RESULT CDECL plc_set_task_options(const char* pszTask, const Task_Options* pOptions);

/* The task whose cycle (or event function) runs on this thread; NULL outside of one. Any. */
Task_Info* CDECL plc_current_task(void);

/* The handle of one of the application's tasks, from __sys__setup__tasks on. It stays valid until the process
 * ends. *pResult (may be NULL): ERR_OK; with RTS_INVALID_HANDLE: ERR_NO_OBJECT: no task of that name;
 * ERR_PARAMETER; ERR_NOTINITIALIZED. Compares names: in a cycle keep the handle instead. Any. */
RTS_HANDLE CDECL SchedGetTaskHandle(const char* pszTask, RTS_RESULT* pResult);

/* The handle of plc_current_task(); RTS_INVALID_HANDLE outside of a cycle. Any. */
RTS_HANDLE CDECL SchedGetCurrentTask(void);

/*
 * The interval of a cyclic task while it runs, in nanoseconds: PLC_MIN_INTERVAL_NS to PLC_MAX_INTERVAL_NS at
 * a granularity of 1 ns, under every scheduler. This is how a fieldbus driver inside of the application lets
 * the task follow a distributed clock ("modify the cycle times of the tasks with a fine granularity").
 *
 * A new interval is the distance between the release that is planned now and the one after it. Set within the
 * task's own cycle it already places the release that follows this cycle. If another thread sets it while the
 * task waits for a release, that release stays. It holds until it is set again, also across an exchange of
 * the scheduler and a stop and start. A reset brings the configured one back. Get returns the value that was
 * set last. ERR_OK; ERR_PARAMETER: not the handle of a cyclic task, or out of range; ERR_NOTINITIALIZED: the
 * tasks are not made yet (plc_app_init). Any.
 */
#define PLC_MIN_INTERVAL_NS 1000L
#define PLC_MAX_INTERVAL_NS 4320000000000000L /* 50 days */
RTS_RESULT CDECL SchedGetTaskInterval(RTS_HANDLE hTask, RTS_I64* pIntervalNs);
RTS_RESULT CDECL SchedSetTaskInterval(RTS_HANDLE hTask, RTS_I64 nIntervalNs);

/*
 * Raises one rising edge for an event task. The scheduler releases the task at its next poll; n calls run it
 * n times, so that an edge which is over between two polls is not lost. From the first call on the calls are
 * the task's edges, for good: its event function is not asked any more. Beyond the backlog that is allowed
 * (ExternalEvent.MaxBacklog) calls are counted as lost events. ERR_OK; ERR_PARAMETER: not the handle of an
 * event task; ERR_NOTINITIALIZED: the tasks are not made yet (plc_app_init). Any.
 */
RTS_RESULT CDECL SchedRaiseEvent(RTS_HANDLE hTask);

/* ---- Memory areas -------------------------------------------------------------------------------------- */

/*
 * An area is a piece of memory of the application. It lies where the settings of the instance want it
 * ([SysMem] Area.N, by its flags), and the runtime may exchange it with others, or keep it:
 *
 *     input     copied in at the start of each cycle of a task that uses it
 *     output    copied out at the end of each cycle of a task that uses it
 *     retain    keeps its values over a restart, a crash and a power cut, but not over a cold reset
 *     persistent    keeps them over a cold reset, too (with or without RETAIN)
 *     others    plain memory that all tasks share
 *
 * Inputs and outputs: each task that uses the area has a copy of its own. So no other task, of whatever
 * priority, changes it in the middle of a cycle, and no other program sees half of a cycle's outputs. A cycle
 * that does not come to its end (a fault) puts nothing out. Each byte of an output has one task that writes
 * it, by pUses; bytes in no task's range are written by whichever task changes them (the last one wins).
 */
#define PLC_AREA_DATA 0x0001u
#define PLC_AREA_CONSTANT 0x0002u
#define PLC_AREA_INPUT 0x0004u
#define PLC_AREA_OUTPUT 0x0008u
#define PLC_AREA_MEMORY 0x0010u
#define PLC_AREA_RETAIN 0x0020u
#define PLC_AREA_CODE 0x0040u
#define PLC_AREA_PERSISTENT 0x0100u
#define PLC_AREA_USER 0xF000u /* the four bits of {attribute 'location' := '16#8000'} */
#define PLC_AREA_ALL 0xFFFFu

#define PLC_MAX_AREAS 64
#define PLC_MAX_AREA_NAME 50
#define PLC_MAX_AREA_USES 14      /* tasks that use one input or output area */
#define PLC_MAX_IMAGE 0x100000u   /* bytes of an input or output area */
#define PLC_MAX_RETAIN 0x1000000u /* bytes of all retain and persistent areas */

/* A task that uses an area. */
typedef struct {
  const char* pszTask;
  unsigned int dwOffset; /* output: the bytes that only this task writes; dwBytes 0: none of its own */
  unsigned int dwBytes;
  void** ppAddress; /* gets the address of this task's copy of the area (input, output); may be null */
} Plc_Area_Use;

/* Fill it with zeros first. */
typedef struct {
  unsigned int dwSize;       /* sizeof(Plc_Area) */
  unsigned int dwFlags;      /* PLC_AREA_..., one or more; INPUT and OUTPUT exclude each other and RETAIN */
  const char* pszName;       /* 1 to PLC_MAX_AREA_NAME letters, digits, _ - . ; unique in the application */
  unsigned int dwBytes;      /* above 0 */
  unsigned int nUses;        /* 0: all tasks use it; an output of one task is all its own then */
  const Plc_Area_Use* pUses; /* retain, persistent: the tasks whose cycles may change it */
  const void* pInitial;      /* dwBytes initial values, copied in the call; null: zeros */
  RTS_UI64 qwLayout;         /* retain, persistent: changes when the meaning of the bytes does; yours */
  void** ppAddress;          /* gets the address, if it is the same for all tasks; may be null */
} Plc_Area;

/*
 * Declares an area. From plc_app_init only. When that has returned, and before the first task runs, the area
 * is placed and its addresses are written. If an area cannot be placed, the application is refused with the
 * line of the settings. *pResult (may be null): ERR_OK. With RTS_INVALID_HANDLE it is ERR_PARAMETER (the log
 * says what is wrong), ERR_DUPLICATE (an area of that name), ERR_NOMEMORY (there are PLC_MAX_AREAS) or
 * ERR_NOTINITIALIZED. Control.
 */
RTS_HANDLE CDECL plc_declare_area(const Plc_Area* pArea, RTS_RESULT* pResult);

/* The address of the area for the caller. An input or output: the copy of the task whose cycle runs on this
 * thread. Null outside of a cycle (an event function is outside) or if the task does not use it. Any other
 * area: the place where it lies. Null: no such handle, or not placed yet. Any. */
void* CDECL plc_area_address(RTS_HANDLE hArea);

#define PLC_AREA_INITIAL 0u  /* began with its initial values */
#define PLC_AREA_RETAINED 1u /* went on with the memory of the process before: nothing is lost */
#define PLC_AREA_RESTORED 2u /* went on with the newest whole file */

typedef struct {
  unsigned int dwSize;   /* sizeof(Plc_Area_State), set by the caller */
  unsigned int dwOrigin; /* retain, persistent: PLC_AREA_... */
  RTS_UI64 qwImages;     /* input, output: number of the latest image that was published */
  RTS_UI64 qwMissed;     /* input: cycles that kept the image before, because the writer was in the way each
                            time; output: cycles whose outputs went out with the next one */
  RTS_UI64 qwSaves;      /* retain, persistent: times that all of it was written to a file */
  RTS_UI64 qwUnsaved;    /* retain, persistent: intervals in which it was not, see the log */
} Plc_Area_State;

/* ERR_OK; ERR_PARAMETER: not such a handle, or dwSize; ERR_NOTINITIALIZED: not placed yet. Any. */
RTS_RESULT CDECL plc_get_area_state(RTS_HANDLE hArea, Plc_Area_State* pState);

/* ---- The instance, online change, variables that are seen from outside --------------------------------- */
#include "plc_instance.h"
#include "plc_online_change.h"
#include "plc_variables.h"

/* ---- Distributed clock --------------------------------------------------------------------------------- */
/*
 * The grids of all cyclic tasks follow a reference clock: their releases lie where its time modulo the task's
 * interval is the task's start offset. Under a scheduler that can move releases (CmpScheduleOneShot); under
 * the others the clock is only measured. The reference comes from firmware by way of a record (see
 * plc_reference_clock.h, [DistributedClock] Reference=NAME), or from a driver inside of the application:
 *
 * Reports what the reference clock shows and CLOCK_MONOTONIC at the same instant, both in nanoseconds. Best
 * in each cycle of the bus; pairs further apart than the timeout (ReferenceTimeoutMs) are hold-over in
 * between. ERR_OK; ERR_DUPLICATE: the settings name a record; ERR_NOTINITIALIZED: the tasks are not made yet.
 * Any.
 */
RTS_RESULT CDECL SchedReportReferenceTime(RTS_I64 nReferenceNs, RTS_I64 nLocalNs);

#define PLC_CLOCK_OFF 0u          /* no reference is named, and none was reported */
#define PLC_CLOCK_FREE_RUNNING 1u /* there is no usable reference (yet) */
#define PLC_CLOCK_ACQUIRING 2u    /* pairs come in; the grid is on its way */
#define PLC_CLOCK_LOCKED 3u       /* pairs come in, in sync */
#define PLC_CLOCK_HOLD_OVER 4u    /* the reference has stopped: the grid goes on with the last drift */
#define PLC_CLOCK_MEASURING 5u    /* measured only: this scheduler does not move releases */

typedef struct {
  unsigned int dwSize;   /* sizeof(Clock_State), set by the caller */
  unsigned int dwState;  /* PLC_CLOCK_... */
  unsigned char bInSync; /* 1: the task's releases are within SyncWindowNs of the reference grid */
  RTS_I64 nOffsetNs;     /* of the task's planned releases from the reference grid; above 0: late */
  RTS_I64 nDriftPpb;     /* the reference is this much faster than CLOCK_MONOTONIC */
  RTS_I64 nCorrectionNs; /* of the task's release that is planned now */
  RTS_UI64 qwPairs;      /* of stamps that were used */
  RTS_UI64 qwRejected;   /* outliers, not valid, too old, out of order or range */
  RTS_UI64 qwSteps;      /* of the reference, that were followed */
} Clock_State;

/* As seen from a cyclic task; RTS_INVALID_HANDLE: from the one of the highest priority. ERR_OK;
 * ERR_PARAMETER: not such a handle, or dwSize; ERR_NOTINITIALIZED. Any. */
RTS_RESULT CDECL SchedGetClockState(RTS_HANDLE hTask, Clock_State* pState);

/* ---- External events ----------------------------------------------------------------------------------- */

/*
 * An external event has a name and is counted: n posts run each bound task n times. The event "ready" is this
 * instance's own; "packer1/product" is the event "product" of the instance packer1. A task is bound to an own
 * event by its stExternalEvent, and registration is a separate act: before or after, by the application, by a
 * component, or by the operator. Posting to an event that is not registered counts nothing.
 *
 * Registers an own event, or gives access to an event of another instance (whose registration is that
 * instance's own). The handle stays valid until the process ends. *pResult (may be NULL): ERR_OK;
 * ERR_DUPLICATE: the application or a component has registered it already; with RTS_INVALID_HANDLE:
 * ERR_PARAMETER, ERR_NOMEMORY, ERR_NOTINITIALIZED. An event that plc_app_init registers counts posts when the
 * application is accepted, after plc_app_init has returned 0. An online change ends registrations of the
 * application that neither plc_app_init nor a callback of the new version makes, too. Control.
 */
RTS_HANDLE CDECL SchedRegisterExternalEvent(const char* pszEvent, RTS_RESULT* pResult);

/* Ends the registration, unless the operator has registered the event, too. ERR_NO_OBJECT: it was not
 * registered. Nothing is done for an event of another instance. Control. */
RTS_RESULT CDECL SchedUnregisterExternalEvent(RTS_HANDLE hEvent);

/* Posts once. ERR_OK; ERR_NO_TASK; ERR_NO_OBJECT; ERR_PARAMETER: not such a handle. Any. */
RTS_RESULT CDECL SchedPostExternalEvent(RTS_HANDLE hEvent);

/* The other way of the seed: be told when a task is there that waits for an external event, keep its hEvent,
 * and set that. It works without a registration, and runs every task that is bound to the same event. */
#define EVT_ExternalEventTaskCreateDone 0x0001u    /* tasks are made, not yet started; or changed online */
#define EVT_PrepareExternalEventTaskDelete 0x0002u /* forget the hEvent now */
/* Areas have their values, no task has started. Once in a process, its parameter is all null. */
#define EVT_PrepareStart 0x0003u

typedef struct {
  const Task_Info* pTaskInfo;
  RTS_HANDLE hEvent;
} EVTPARAM_ExternalEventTask;

typedef void(CDECL* PF_EVENT_CALLBACK)(unsigned int EventId, const EVTPARAM_ExternalEventTask* pParam,
                                       void* pUser);

#define PLC_MAX_EVENT_CALLBACKS 32

/* ERR_OK; ERR_DUPLICATE: these three are registered already; ERR_PARAMETER; ERR_NOMEMORY. Control. */
RTS_RESULT CDECL EventRegisterCallbackFunction(unsigned int EventId, PF_EVENT_CALLBACK pfCallback,
                                               void* pUser);
/* ERR_OK; ERR_NO_OBJECT: not registered. Control. */
RTS_RESULT CDECL EventUnregisterCallbackFunction(unsigned int EventId, PF_EVENT_CALLBACK pfCallback,
                                                 void* pUser);

/* Runs the tasks bound to this event once. ERR_OK; ERR_NO_TASK; ERR_PARAMETER: not such a handle. Any. */
RTS_RESULT CDECL CAL_SysEventSet(RTS_HANDLE hEvent);

/* ---- Blocks between instances -------------------------------------------------------------------------- */

/*
 * Instances send each other blocks of 0 to PLC_MAX_BLOCK bytes by address, in their cycles (CmpBlkDrvShm). A
 * channel is a named place where blocks come in, and from which they go to the channel of the same name of
 * another instance. An instance that opens one gets an address ([CmpBlkDrvShm] ForcedAddress, or any). A
 * block that nobody receives is dropped after a second ([CmpBlkDrvShm] HoldMs).
 */
#define PLC_MAX_BLOCK 65536u
#define PLC_MAX_CHANNELS 256
#define PLC_MAX_CHANNEL_NAME 63

/* An address: the node in the lower 16 bits, its host in the upper ones; host 0 is this host, others have the
 * number that their configuration says ([blocks] host_number). */
#define PLC_NO_NODE 0u
#define PLC_ALL_NODES 0xFFFFu /* every other node of this host; (host << 16) | PLC_ALL_NODES: of that one */
#define PLC_ALL_HOSTS 0xFFFFFFFFu /* every other node of this and all other hosts */

/* Blocks of the higher priority are received first; each priority has queues of its own. */
#define PLC_BLOCK_EMERGENCY 0
#define PLC_BLOCK_HIGH 1
#define PLC_BLOCK_NORMAL 2
#define PLC_BLOCK_LOW 3

#define PLC_BLOCK_MESSAGE 0u
#define PLC_BLOCK_REQUEST 1u /* somebody waits for a reply: plc_channel_reply() */
#define PLC_BLOCK_REPLY 2u   /* to the request with the same dwCorrelation */

typedef struct {
  unsigned int dwSize;        /* sizeof(Block_Info), set by the caller */
  unsigned int dwBytes;       /* of the block; with ERR_BUFFERSIZE: that the buffer must have */
  unsigned int dwFrom;        /* the sender's address */
  unsigned int dwCorrelation; /* of a request, and of the reply to it */
  unsigned char bKind;        /* PLC_BLOCK_MESSAGE, _REQUEST or _REPLY */
  unsigned char bPriority;
} Block_Info;

/* The channel of that name: 1 to PLC_MAX_CHANNEL_NAME letters, digits, '_', '-', '.'. The same name has the
 * same handle. It stays valid until the process ends. *pResult (may be NULL): ERR_OK; with
 * RTS_INVALID_HANDLE: ERR_PARAMETER, ERR_NOMEMORY, ERR_NOTINITIALIZED, ERR_FAILED: the instance can be no
 * node; the log says why. Control. */
RTS_HANDLE CDECL plc_channel_open(const char* pszName, RTS_RESULT* pResult);

/* The address of the instance of that name, "packer", or of one of another host, "packer@south"; NULL: of
 * this one. PLC_NO_NODE: there is none (yet). Looks at up to 128 names: in a cycle keep the address, which an
 * instance has again after a restart. Any. */
unsigned int CDECL plc_node_address(const char* pszInstance);

/* Sends a block. Never waits. ERR_OK: it is in the queue of the next node on the way; ERR_NOBUFFER;
 * ERR_PENDING; ERR_NO_OBJECT: nobody has the address, or no way leads there; ERR_PARAMETER;
 * ERR_NOTINITIALIZED. Any. */
RTS_RESULT CDECL plc_channel_send(RTS_HANDLE hChannel, unsigned int dwTo, int nPriority, const void* pData,
                                  unsigned int dwBytes);
/* The same, for a block that wants a reply. *pCorrelation tells which reply is the one. Any. */
RTS_RESULT CDECL plc_channel_request(RTS_HANDLE hChannel, unsigned int dwTo, int nPriority, const void* pData,
                                     unsigned int dwBytes, unsigned int* pCorrelation);
/* Answers the request that plc_channel_receive() has described. Results as plc_channel_send(). Any. */
RTS_RESULT CDECL plc_channel_reply(RTS_HANDLE hChannel, const Block_Info* pRequest, const void* pData,
                                   unsigned int dwBytes);
/* The next block that has come, into pBuffer. Never waits. ERR_OK; ERR_NO_OBJECT: there is none;
 * ERR_BUFFERSIZE; ERR_PARAMETER; ERR_NOTINITIALIZED. Any. */
RTS_RESULT CDECL plc_channel_receive(RTS_HANDLE hChannel, void* pBuffer, unsigned int dwBufferSize,
                                     Block_Info* pInfo);

/* ---- Time ---------------------------------------------------------------------------------------------- */

/*
 * Clocks that only go forward, from an origin that means nothing by itself: CLOCK_MONOTONIC, or what the
 * settings name ([SysTime] CustomSysTimeGetUs, CustomSysTimeGetNs, CustomSysTimeLibrary). All three have one
 * base. The schedulers themselves stay on CLOCK_MONOTONIC.
 */
typedef RTS_UI64 RTS_SYSTIME;

/* ERR_OK; ERR_PARAMETER: pTime is NULL; or what the custom function returns. Any. */
RTS_RESULT CDECL SysTimeGetUs(RTS_SYSTIME* pTime);
RTS_RESULT CDECL SysTimeGetNs(RTS_SYSTIME* pTime);

/* Milliseconds, which begin anew at 0 after 2^32 of them. Any. */
unsigned int CDECL SysTimeGetMs(void);

/* The functions of a library that the settings name. It is called from any context. */
typedef RTS_RESULT(CDECL* PF_SYSTIME)(RTS_SYSTIME* pTime);

/* ---- Messages ------------------------------------------------------------------------------------------ */

#define PLC_LOG_INFO 0
#define PLC_LOG_WARNING 1
#define PLC_LOG_ERROR 2
#define PLC_LOG_MAX_TEXT 200

/* Puts one line (cut to PLC_LOG_MAX_TEXT bytes) into the instance's log. It is only queued here and written
 * by the control thread within 100 ms; lines for which the queue has no room are counted, and the count is
 * logged. Any. */
void CDECL plc_log(int nLevel, const char* pszText);

/* ---- Components ---------------------------------------------------------------------------------------- */

/*
 * A component extends the runtime (a driver that posts events, say). It is a shared object that exports
 * plc_app_abi and HookFunction, named in the settings: [ComponentManager] Component.1=FILE. Each hook is
 * called for all components before the next one. CH_INIT, CH_INIT2, CH_INIT3 come in the order of their
 * numbers, before the application is loaded. CH_EXIT3, CH_EXIT2, CH_EXIT come in reverse order, after the
 * application's tasks have ended. Another result than ERR_OK from a CH_INIT.. ends the start of the instance.
 * Threads are started in CH_INIT3 and have ended when CH_EXIT3 returns. Unknown hooks return ERR_OK.
 * CH_TRIAL is the only hook that the trial of an application calls, in a process of its own, while the
 * instance runs with the component initialised. The component checks whether its CH_INIT.. would succeed, and
 * takes nothing. Another result than ERR_OK refuses the application.
 */
#define CH_INIT 1u
#define CH_INIT2 2u
#define CH_INIT3 3u
#define CH_EXIT3 4u
#define CH_EXIT2 5u
#define CH_EXIT 6u
#define CH_TRIAL 7u

PLC_EXPORT RTS_RESULT CDECL HookFunction(unsigned int ulHook, unsigned long ulParam1, unsigned long ulParam2);

#ifdef __cplusplus
}
#endif

#endif
