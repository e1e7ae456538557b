/*
 * Online change, a part of plc_app.h.
 *
 * Another version of the program takes over while its tasks run ("plcctl load application ... --online"). It
 * is loaded beside the one that runs, and its plc_app_init is called. When no task is in a cycle, the tasks
 * get its functions. Their grids, figures, posted events, handles and intervals go on, and no cycle is lost.
 * The program keeps:
 *
 *     areas         all of them: the new program gets the addresses of the same memory
 *     variables     those that both versions name by plc_keep_variables(): copied in that moment
 *     all else      (static variables) begins in the new program as it does when that is loaded
 *
 * It is refused, with the reasons, unless it has the same name, the same tasks (name, kind, priority,
 * interval, event, options) and the same areas (name, flags, size, layout, uses). Each variable that both
 * name must have the same size and layout. It is also refused if its plc_app_init does not return 0, or if it
 * has symbols that exist once in a process (g++: build it with -fno-gnu-unique). Then the program before runs
 * on as if nothing had been. In the new program's plc_app_init the calls for tasks that run
 * (SchedSetTaskInterval() ...) are ERR_NOTINITIALIZED as in any other, and an area has no address yet.
 *
 * Then the callbacks of the program before are forgotten, and its events that the new one does not register
 * are unregistered. EVT_ExternalEventTaskCreateDone is told again to all callbacks (the same hEvent;
 * pTaskInfo is that of the new program, and that of the one before is void). Then plc_app_exit of the program
 * before is called, and that is unloaded. It must leave no thread behind, and nothing that points to its code
 * or its constants, neither in areas nor in retain variables. A new program that is refused after its
 * plc_app_init has returned 0 gets its plc_app_exit, too. In both, SchedUnregisterExternalEvent() of an event
 * that the program that runs on has registered in its plc_app_init is ERR_NO_OBJECT and changes nothing.
 */
#ifndef PLC_ONLINE_CHANGE_H
#define PLC_ONLINE_CHANGE_H

#include "plc_app.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PLC_MAX_VARIABLES 65536u /* that a program may name */
#define PLC_MAX_VARIABLE_NAME 250
#define PLC_MAX_VARIABLE_BYTES 0x100000u /* of all of them: they are copied while all tasks wait */

/* Names variables that an online change carries over: dwBytes at pAddress, which are copied to where the new
 * version has its variable of this name. Your qwLayout changes when the meaning of the bytes does.
 * A variable that only the new version names keeps its initial value. Null and 0 bytes: nothing is copied,
 * and qwLayout is compared all the same. From plc_app_init only. ERR_OK; ERR_PARAMETER: one of the two, or
 * pszName is not 1 to PLC_MAX_VARIABLE_NAME letters, digits, _ - . ; ERR_DUPLICATE: one of that name;
 * ERR_NOMEMORY: too many, or too many bytes; ERR_NOTINITIALIZED. Control. */
RTS_RESULT CDECL plc_keep_variables(const char* pszName, void* pAddress, unsigned int dwBytes,
                                    RTS_UI64 qwLayout);

/* 1: the machine runs on. This plc_app_init is to take over from a program that runs. Or this plc_app_exit is
 * that of a refused program, or of one from which another version has taken over. 0: else. Control. */
int CDECL plc_online_change(void);

#ifdef __cplusplus
}
#endif

#endif
