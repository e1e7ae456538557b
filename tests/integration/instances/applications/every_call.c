/* Refers to every function that the runtime offers, in plain C89: it loads only if each of them is there. */
#include "../../../../instances/plc_app.h"
#include "../../../../instances/plc_debug.h"

typedef void (*any_function)(void);

const any_function every_call[] = {
    (any_function)__sys__setup__tasks,
    (any_function)plc_current_task,
    (any_function)plc_start_kind,
    (any_function)plc_instance_name,
    (any_function)plc_parameter,
    (any_function)plc_set_task_options,
    (any_function)plc_prefer_scheduler,
    (any_function)plc_declare_area,
    (any_function)plc_area_address,
    (any_function)plc_get_area_state,
    (any_function)plc_declare_variable,
    (any_function)plc_apply_forces,
    (any_function)plc_debug_declare_pou,
    (any_function)plc_debug_declare_instance,
    (any_function)plc_debug_enter,
    (any_function)plc_debug_leave,
    (any_function)plc_debug_statement,
    (any_function)plc_keep_variables,
    (any_function)plc_online_change,
    (any_function)SchedRegisterExternalEvent,
    (any_function)SchedUnregisterExternalEvent,
    (any_function)SchedPostExternalEvent,
    (any_function)SchedGetTaskHandle,
    (any_function)SchedGetCurrentTask,
    (any_function)SchedGetTaskInterval,
    (any_function)SchedSetTaskInterval,
    (any_function)SchedRaiseEvent,
    (any_function)SchedReportReferenceTime,
    (any_function)SchedGetClockState,
    (any_function)EventRegisterCallbackFunction,
    (any_function)EventUnregisterCallbackFunction,
    (any_function)CAL_SysEventSet,
    (any_function)plc_channel_open,
    (any_function)plc_node_address,
    (any_function)plc_channel_send,
    (any_function)plc_channel_request,
    (any_function)plc_channel_reply,
    (any_function)plc_channel_receive,
    (any_function)SysTimeGetMs,
    (any_function)SysTimeGetUs,
    (any_function)SysTimeGetNs,
    (any_function)plc_log,
};

PLC_EXPORT_ABI;

static void cycle(void) {}

static Task_Info task = {"Main", 1, Cyclic, 0, 100, 0, "", cycle, 0, 0, 0, 0, 0, 0};
static sys_setup_tasks_struct setup = {1, "EveryCall", &task};

int plc_app_init(void) {
  __sys__setup__tasks(&setup);
  return 0;
}
