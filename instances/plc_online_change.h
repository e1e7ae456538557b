/*
 * Online change, a part of plc_app.h.
 *
 * Another version of the program takes over while its tasks run ("plcctl load application ... --online"): it
 * is loaded beside the one that runs, its plc_app_init is called, and in a moment in which no task is in a
 * cycle the tasks get its functions. Their grids, figures, posted events, handles and intervals go on, and no
 * cycle is lost. What the program keeps:
 *
 *     areas         all of them: the new program gets the addresses of the same memory
 *     variables     those that both versions name by plc_keep_variables(): copied in that moment
 *     all else      (static variables) begins in the new program as it does when that is loaded
 *
 * It is refused, with the reasons, and the program before runs on as if nothing had been, unless the new one
 * has the same name, the same tasks (name, kind, priority, interval, event, options) and the same areas
 * (name, flags, size, layout, uses), and of each variable that both name the same size and layout; if its
 * plc_app_init does not return 0; or if it has symbols that exist once in a process (g++: build it with
 * -fno-gnu-unique). In this plc_app_init the calls for tasks that run (SchedSetTaskInterval() ...) are
 * ERR_NOTINITIALIZED as in any other, and an area has no address yet.
 *
 * Then the callbacks that the program before has registered are forgotten, events that it has registered and
 * the new one does not are unregistered, EVT_ExternalEventTaskCreateDone is told again to all callbacks (the
 * same hEvent; pTaskInfo is that of the new program, and that of the one before is void), plc_app_exit of the
 * program before is called, and that is unloaded: it must leave no thread behind, and nothing that points to
 * its code or its constants, neither in areas nor in retain variables. A new program that is refused after
 * its plc_app_init has returned 0 gets its plc_app_exit, too.
 */
#ifndef PLC_ONLINE_CHANGE_H
#define PLC_ONLINE_CHANGE_H

#include "plc_app.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PLC_MAX_VARIABLES 256u /* that a program may name */
#define PLC_MAX_VARIABLE_NAME 50
#define PLC_MAX_VARIABLE_BYTES 0x100000u /* of all of them: they are copied while all tasks wait */

/* Names variables that an online change carries over: dwBytes at pAddress, which are copied to where the new
 * version has its variable of this name. qwLayout is yours: it changes when the meaning of the bytes does.
 * What only the new version names keeps its initial value. From plc_app_init only. ERR_OK; ERR_PARAMETER:
 * null, no bytes, or pszName is not 1 to PLC_MAX_VARIABLE_NAME letters, digits, _ - . ; ERR_DUPLICATE: one of
 * that name; ERR_NOMEMORY: too many, or too many bytes; ERR_NOTINITIALIZED. Control. */
RTS_RESULT CDECL plc_keep_variables(const char* pszName, void* pAddress, unsigned int dwBytes,
                                    RTS_UI64 qwLayout);

/* 1: this plc_app_init is to take over from a program that runs, or this plc_app_exit is that of a program
 * from which another version has taken over, or of one that was refused: the machine runs on. 0: else.
 * Control. */
int CDECL plc_online_change(void);

#ifdef __cplusplus
}
#endif

#endif
