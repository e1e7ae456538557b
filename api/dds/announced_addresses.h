#pragma once

#include <dds/dds.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Where a participant receives discovery.
typedef struct plc_Address {
  int32_t kind;  ///< as Cyclone numbers them
  uint32_t port;
  uint8_t octets[16];
} plc_Address;

// Of these functions, `participant` is of this process. Each works only in a thread whose last call of DDS
// was to the domain of that participant, as after it was made; else there are no addresses. Those that tell
// addresses return how many there are, also if that is more than `most`.

/// Whether they work here.
bool plc_can_tell_addresses(dds_entity_t participant);

/// To which addresses this process announces itself by unicast.
///
/// Cyclone DDS 0.10.2 adds the address of each participant that it discovers and that receives no multicast,
/// and never removes one. After 10,000 clients have come and gone, it would send 10,000 datagrams with each
/// announcement.
size_t plc_announced_addresses(dds_entity_t participant, plc_Address* addresses, size_t most);

/// The addresses of a remote participant. None, if it is not there.
size_t plc_addresses_of(dds_entity_t participant, const dds_guid_t* remote, plc_Address* addresses,
                        size_t most);

/// Announces this process no longer to that address. Returns false if it did not.
bool plc_stop_announcing_to(dds_entity_t participant, const plc_Address* address);

/// Announces this process to that address of a remote participant, as when that one was discovered. Returns
/// false if it is not there, or has another address.
bool plc_announce_to(dds_entity_t participant, const dds_guid_t* remote, const plc_Address* address);

#ifdef __cplusplus
}
#endif
