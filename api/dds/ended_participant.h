#pragma once

#include <dds/dds.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Deletes what this process knows of the remote participant that has the writer `publication`, as if its
/// lease had ended. For a participant that is known to have ended: of one that goes on, a secured one would
/// not be authenticated again until it has dropped this process, too.
///
/// Cyclone DDS keeps what a participant that was killed has not acknowledged until its lease ends. Until then
/// a writer whose history is full blocks, even if all others have acknowledged everything.
///
/// `reader`: it is matched with `publication`. Returns false if it is not, or not any more. Any thread.
bool plc_forget_participant(dds_entity_t reader, dds_instance_handle_t publication);

#ifdef __cplusplus
}
#endif
