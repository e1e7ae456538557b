#pragma once

// Internals of Cyclone DDS, for the sources that free the things that it keeps too long. In C, because these
// headers are not valid in C++.

#include <arpa/inet.h>
#include <dds/dds.h>
#include <stddef.h>
#include <string.h>

// In an order in which each has what it needs.
// clang-format off
#include <dds/ddsi/ddsi_domaingv.h>
#include <dds/ddsi/ddsi_entity.h>
#include <dds/ddsi/q_hbcontrol.h>
#include <dds/ddsi/ddsi_endpoint.h>
#include <dds/ddsi/ddsi_entity_index.h>
#include <dds/ddsi/ddsi_entity_match.h>
#include <dds/ddsi/ddsi_proxy_endpoint.h>
#include <dds/ddsi/ddsi_proxy_participant.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_tkmap.h>
#include <dds/ddsi/ddsi_tran.h>
#include <dds/ddsi/q_rtps.h>
#include <dds/ddsi/q_thread.h>
#include <dds/ddsi/q_whc.h>
// The headers below would include one of iceoryx, which Cyclone's package does not bring.
#undef DDS_HAS_SHM
#include <dds/ddsi/ddsi_participant.h>
#include <dds/ddsi/ddsi_security_omg.h>
#include <dds/security/core/dds_security_utils.h>
#include <dds/security/dds_security_api_authentication.h>
#include <dds/security/dds_security_api_cryptography.h>
#include <dds/security/dds_security_api_err.h>
// clang-format on

// Where what is used lies in the releases that are known. Headers that were patched, or configured otherwise,
// do not compile here; the build says so and leaves the mends out.
#ifdef __x86_64__
#define PLC_LIES_AT(type, member, offset, size)                                              \
  _Static_assert(offsetof(type, member) == (offset) && sizeof(((type*)0)->member) == (size), \
                 #type "." #member " lies elsewhere")
PLC_LIES_AT(struct ddsi_domaingv, disc_conn_mc, 1056, 8);
PLC_LIES_AT(struct ddsi_domaingv, data_conn_mc, 1064, 8);
PLC_LIES_AT(struct ddsi_domaingv, disc_conn_uc, 1072, 8);
PLC_LIES_AT(struct ddsi_domaingv, data_conn_uc, 1080, 8);
PLC_LIES_AT(struct ddsi_domaingv, xmit_conns, 1088, sizeof(void*) * MAX_XMIT_CONNS);
PLC_LIES_AT(struct ddsi_domaingv, n_interfaces, 1432, 4);
PLC_LIES_AT(struct ddsi_tran_conn, m_read_fn, 32, 8);
PLC_LIES_AT(struct ddsi_domaingv, m_tkmap, 960, 8);
PLC_LIES_AT(struct ddsi_domaingv, entity_index, 968, 8);
PLC_LIES_AT(struct ddsi_domaingv, as_disc, 2008, 8);
PLC_LIES_AT(struct ddsi_domaingv, sedp_writer_type, 6968, 8);
PLC_LIES_AT(struct ddsi_domaingv, sedp_writer_secure_type, 7024, 8);
PLC_LIES_AT(struct ddsi_proxy_participant, as_meta, 264, 8);
PLC_LIES_AT(struct ddsi_participant, sec_attr, 352, 8);
PLC_LIES_AT(struct participant_sec_attributes, local_identity_handle, 80, 8);
PLC_LIES_AT(struct ddsi_tkmap_instance, m_refc, 16, 4);
PLC_LIES_AT(struct ddsi_writer, e.lock, 48, 40);
PLC_LIES_AT(struct ddsi_writer, seq, 272, 8);
PLC_LIES_AT(struct ddsi_writer, seq_xmit, 288, 8);
PLC_LIES_AT(struct ddsi_writer, state, 368, 4);
PLC_LIES_AT(struct ddsi_writer, type, 392, 8);
PLC_LIES_AT(struct ddsi_writer, whc, 424, 8);
PLC_LIES_AT(struct ddsi_writer, readers, 488, 8);
PLC_LIES_AT(struct ddsi_wr_prd_match, min_seq, 56, 8);
PLC_LIES_AT(struct ddsi_wr_prd_match, seq, 72, 8);
PLC_LIES_AT(struct ddsi_wr_prd_match, last_seq, 80, 8);
PLC_LIES_AT(struct ddsi_proxy_reader, c.vendor, 232, 2);
PLC_LIES_AT(struct ddsi_proxy_reader, filter, 288, 8);
PLC_LIES_AT(struct ddsi_serdata, statusinfo, 40, 4);
PLC_LIES_AT(struct thread_state, gv, 8, 8);
#undef PLC_LIES_AT
#endif

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
