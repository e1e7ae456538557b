#pragma once

#include <dds/dds.h>
#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Looks at a datagram before Cyclone does: `size` bytes in a buffer that holds `capacity`. Returns how many
/// bytes Cyclone reads instead; 0: none. Called by the threads of Cyclone that receive.
typedef size_t (*plc_DatagramFilter)(unsigned char* buffer, size_t size, size_t capacity);

/// From now on, all that is received in the domain of `participant`, which this thread has just made, goes
/// through `filter`. A process has one filter. False: the release of Cyclone is not known, nothing is
/// filtered.
bool plc_filter_datagrams(dds_entity_t participant, plc_DatagramFilter filter);

#ifdef __cplusplus
}
#endif
