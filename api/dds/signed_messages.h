#pragma once

#include <dds/dds.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// From now on, this process decodes a signed message once, also if it has several secured participants.
/// `participant`: of this process; this thread has just made it. False: it is not secured, or the release of
/// Cyclone is not known.
///
/// Cyclone DDS 0.10.2 to 0.10.5 decodes a message once for each participant of the process that has
/// authenticated the sender. It frees the last result only. And if one participant does not have the sender's
/// keys yet, as at the end of each handshake, Cyclone drops the message for all of them.
/// The signature is the same for all receivers, so one of them is enough to check it.
bool plc_decode_signed_once(dds_entity_t participant);

#ifdef __cplusplus
}
#endif
