#include "api/dds/instance_pin.h"

#include <string.h>

#include "api/dds/cyclone_internals.h"
#include "api/dds/cyclone_version.h"

static const plc_InstancePin kNoPin = {NULL, NULL, 0};

// `key` may be null, and is used up.
static plc_InstancePin pin(struct ddsi_domaingv* domain, struct ddsi_serdata* key) {
  if (key == NULL) return kNoPin;
  struct ddsi_tkmap_instance* const found = ddsi_tkmap_find(domain->m_tkmap, key, false);
  ddsi_serdata_unref(key);
  if (found == NULL) return kNoPin;
  const plc_InstancePin result = {domain, found, ddsrt_atomic_ld32(&found->m_refc)};
  return result;
}

plc_InstancePin plc_pin_instance(dds_entity_t writer, const void* sample) {
  dds_guid_t guid;
  if (plc_unknown_cyclone() != NULL || dds_lookup_instance(writer, sample) == DDS_HANDLE_NIL ||
      dds_get_guid(writer, &guid) != DDS_RETCODE_OK) {
    return kNoPin;
  }
  struct ddsi_domaingv* const domain = plc_domain_of_last_call();
  struct thread_state* const thread = lookup_thread_state();
  const ddsi_guid_t its_guid = plc_in_host_order(&guid);
  plc_InstancePin result = kNoPin;
  thread_state_awake(thread, domain);
  const struct ddsi_writer* const known = entidx_lookup_writer_guid(domain->entity_index, &its_guid);
  if (known != NULL) result = pin(domain, ddsi_serdata_from_sample(known->type, SDK_KEY, sample));
  thread_state_asleep(thread);
  return result;
}

plc_InstancePin plc_pin_announcement(dds_entity_t entity) {
  dds_guid_t guid;
  // The first one for the sake of the domain.
  if (plc_unknown_cyclone() != NULL || dds_get_matched_subscriptions(entity, NULL, 0) < 0 ||
      dds_get_guid(entity, &guid) != DDS_RETCODE_OK) {
    return kNoPin;
  }
  struct ddsi_domaingv* const domain = plc_domain_of_last_call();
  struct thread_state* const thread = lookup_thread_state();
  ddsi_keyhash_t key;
  memcpy(key.value, guid.v, sizeof key.value);
  plc_InstancePin result = kNoPin;
  thread_state_awake(thread, domain);
  // Secured writers are announced by another builtin writer.
  const struct ddsi_sertype* const types[] = {domain->sedp_writer_type, domain->sedp_writer_secure_type};
  for (size_t i = 0; i < sizeof types / sizeof types[0] && result.instance == NULL; ++i) {
    if (types[i] != NULL) result = pin(domain, ddsi_serdata_from_keyhash(types[i], &key));
  }
  thread_state_asleep(thread);
  return result;
}

void plc_take_off_pin(plc_InstancePin taken) {
  if (taken.instance == NULL) return;
  struct thread_state* const thread = lookup_thread_state();
  thread_state_awake(thread, taken.domain);
  const bool was_forgotten = ddsrt_atomic_ld32(&taken.instance->m_refc) == taken.references;
  ddsi_tkmap_instance_unref(taken.domain->m_tkmap, taken.instance);
  if (was_forgotten) ddsi_tkmap_instance_unref(taken.domain->m_tkmap, taken.instance);
  thread_state_asleep(thread);
}
