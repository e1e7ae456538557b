#include "api/dds/ended_participant.h"

#include "api/dds/cyclone_internals.h"
#include "api/dds/cyclone_version.h"

bool plc_forget_participant(dds_entity_t reader, dds_instance_handle_t publication) {
  if (plc_unknown_cyclone() != NULL) return false;
  dds_builtintopic_endpoint_t* const endpoint = dds_get_matched_publication_data(reader, publication);
  if (endpoint == NULL) return false;
  const ddsi_guid_t guid = plc_in_host_order(&endpoint->participant_key);
  dds_builtintopic_free_endpoint(endpoint);
  struct ddsi_domaingv* const domain = plc_domain_of_last_call();
  struct thread_state* const thread = lookup_thread_state();
  thread_state_awake(thread, domain);
  const int result = ddsi_delete_proxy_participant_by_guid(domain, &guid, ddsrt_time_wallclock(), 1);
  thread_state_asleep(thread);
  return result == 0;
}
