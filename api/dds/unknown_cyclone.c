// In the place of the mends, where the release of Cyclone DDS or the layout of its structures is not known.
#include <dds/version.h>

#include "api/dds/announced_addresses.h"
#include "api/dds/cyclone_version.h"
#include "api/dds/datagram_filter.h"
#include "api/dds/ended_participant.h"
#include "api/dds/handshakes.h"
#include "api/dds/instance_pin.h"
#include "api/dds/secured_announcement.h"
#include "api/dds/signed_messages.h"
#include "api/dds/told_keys.h"

static const plc_InstancePin kNoPin = {NULL, NULL, 0};

const char* plc_unknown_cyclone(void) {
  return "plchost was built with Cyclone DDS " DDS_VERSION " with internals that it does not know";
}

plc_InstancePin plc_pin_instance(dds_entity_t writer, const void* sample) {
  (void)writer;
  (void)sample;
  return kNoPin;
}

plc_InstancePin plc_pin_announcement(dds_entity_t entity) {
  (void)entity;
  return kNoPin;
}

void plc_take_off_pin(plc_InstancePin pin) {
  (void)pin;
}

uint32_t plc_forget_told_keys(dds_entity_t reader) {
  (void)reader;
  return 0;
}

bool plc_can_tell_addresses(dds_entity_t participant) {
  (void)participant;
  return false;
}

size_t plc_announced_addresses(dds_entity_t participant, plc_Address* addresses, size_t most) {
  (void)participant;
  (void)addresses;
  (void)most;
  return 0;
}

size_t plc_addresses_of(dds_entity_t participant, const dds_guid_t* remote, plc_Address* addresses,
                        size_t most) {
  (void)participant;
  (void)remote;
  (void)addresses;
  (void)most;
  return 0;
}

bool plc_stop_announcing_to(dds_entity_t participant, const plc_Address* address) {
  (void)participant;
  (void)address;
  return false;
}

bool plc_announce_to(dds_entity_t participant, const dds_guid_t* remote, const plc_Address* address) {
  (void)participant;
  (void)remote;
  (void)address;
  return false;
}

bool plc_forget_participant(dds_entity_t reader, dds_instance_handle_t publication) {
  (void)reader;
  (void)publication;
  return false;
}

bool plc_announce_secured(dds_entity_t participant) {
  (void)participant;
  return false;
}

bool plc_spare_announcement(dds_entity_t participant, const dds_guid_t* remote) {
  (void)participant;
  (void)remote;
  return false;
}

bool plc_filter_datagrams(dds_entity_t participant, plc_DatagramFilter filter) {
  (void)participant;
  (void)filter;
  return false;
}

bool plc_watch_handshakes(dds_entity_t participant) {
  (void)participant;
  return false;
}

plc_SignUse plc_take_sign(const plc_HandshakeSign* sign) {
  (void)sign;
  return PLC_SIGN_OF_USE;
}

bool plc_is_doubted(const unsigned char* from) {
  (void)from;
  return false;
}

bool plc_decode_signed_once(dds_entity_t participant) {
  (void)participant;
  return false;
}
