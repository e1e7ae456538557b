#pragma once

// What Cyclone DDS keeps to itself, for the sources that mend what it keeps too long. In C, because these
// headers are not valid in C++.

#include <arpa/inet.h>
#include <dds/dds.h>
#include <string.h>

// In an order in which each has what it needs.
// clang-format off
#include <dds/ddsi/ddsi_domaingv.h>
#include <dds/ddsi/ddsi_entity.h>
#include <dds/ddsi/q_hbcontrol.h>
#include <dds/ddsi/ddsi_endpoint.h>
#include <dds/ddsi/ddsi_entity_index.h>
#include <dds/ddsi/ddsi_entity_match.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_tkmap.h>
#include <dds/ddsi/q_rtps.h>
#include <dds/ddsi/q_thread.h>
#include <dds/ddsi/q_whc.h>
// clang-format on

/// The domain of this thread's last call: Cyclone notes it in its state of the thread.
static inline struct ddsi_domaingv* plc_domain_of_last_call(void) {
  return (struct ddsi_domaingv*)ddsrt_atomic_ldvoidp(&lookup_thread_state()->gv);
}

static inline ddsi_guid_t plc_in_host_order(const dds_guid_t* guid) {
  uint32_t words[4];
  memcpy(words, guid->v, sizeof words);
  const ddsi_guid_t result = {.prefix = {.u = {ntohl(words[0]), ntohl(words[1]), ntohl(words[2])}},
                              .entityid = {.u = ntohl(words[3])}};
  return result;
}
