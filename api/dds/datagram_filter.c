#include "api/dds/datagram_filter.h"

#include <stdatomic.h>

#include "api/dds/cyclone_internals.h"
#include "api/dds/cyclone_version.h"

static _Atomic(plc_DatagramFilter) used_filter;
// All sockets of a process are read by the same function.
static _Atomic(ddsi_tran_read_fn_t) read_unfiltered;

static ssize_t read_filtered(ddsi_tran_conn_t connection, unsigned char* buffer, size_t capacity,
                             bool allow_spurious, ddsi_locator_t* source) {
  // Cyclone has read this pointer without an order: now what was stored before it is seen, on any processor.
  (void)__atomic_load_n(&connection->m_read_fn, __ATOMIC_ACQUIRE);
  const ssize_t got = atomic_load(&read_unfiltered)(connection, buffer, capacity, allow_spurious, source);
  if (got <= 0 || (size_t)got > capacity) return got;
  return (ssize_t)atomic_load(&used_filter)(buffer, (size_t)got, capacity);
}

static void filter_connection(ddsi_tran_conn_t connection) {
  if (connection == NULL || connection->m_read_fn == read_filtered) return;
  atomic_store(&read_unfiltered, connection->m_read_fn);
  __atomic_store_n(&connection->m_read_fn, read_filtered, __ATOMIC_RELEASE);
}

bool plc_filter_datagrams(dds_entity_t participant, plc_DatagramFilter filter) {
  dds_guid_t guid;
  if (plc_unknown_cyclone() != NULL || dds_get_guid(participant, &guid) != DDS_RETCODE_OK) return false;
  const struct ddsi_domaingv* const domain = plc_domain_of_last_call();
  if (domain == NULL) return false;
  atomic_store(&used_filter, filter);
  filter_connection(domain->disc_conn_mc);
  filter_connection(domain->data_conn_mc);
  filter_connection(domain->disc_conn_uc);
  filter_connection(domain->data_conn_uc);
  for (int i = 0; i < domain->n_interfaces; ++i) filter_connection(domain->xmit_conns[i]);
  return true;
}
