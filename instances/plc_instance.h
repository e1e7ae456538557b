/*
 * The instance that an application runs in, a part of plc_app.h.
 */
#ifndef PLC_INSTANCE_H
#define PLC_INSTANCE_H

#include "plc_app.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Why the process of this application began. An application that keeps data of its own decides by it whether
 * to go on with them, as the runtime does. After PLC_START_COLD retain areas begin with initial values. Else
 * they, and persistent areas always, go on with their last values if the layout is the same. Any. */
#define PLC_START_FIRST 0       /* by hand, first start by this manager, or another application was loaded */
#define PLC_START_WARM 1        /* warm reset, or restart */
#define PLC_START_COLD 2        /* cold reset: begin with initial values */
#define PLC_START_AFTER_FAULT 3 /* the process before ended by itself (a crash) and is started again */
int CDECL plc_start_kind(void);

/* The name of the instance that runs this application: "line1". Valid until the process ends. Any. */
const char* CDECL plc_instance_name(void);

/* The text of "Parameter.pszName" in the section [Application] of the instance's settings: one program runs
 * in several instances, each with values of its own. Valid until the process ends. NULL: pszName is null, or
 * the parameter is not set; it may be set to an empty text. Compares names: in a cycle keep the text instead.
 * Any. */
const char* CDECL plc_parameter(const char* pszName);

/* The scheduler that the application is made for, one of those that `plc-instance --help` lists. It is used
 * by a fresh process if nothing else names one: the configuration of the host, `plcctl set scheduler`, or
 * TimerMode=OneShot in the settings. An online change does not use it. From plc_app_init only.
 * ERR_OK; ERR_PARAMETER: null, or no scheduler of that name (the log names them); ERR_DUPLICATE: named
 * already; ERR_NOTINITIALIZED. Control. */
RTS_RESULT CDECL plc_prefer_scheduler(const char* pszScheduler);

#ifdef __cplusplus
}
#endif

#endif
