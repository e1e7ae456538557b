#include "api/dds/announced_addresses.h"

#include <dds/ddsi/q_addrset.h>

#include "api/dds/cyclone_internals.h"
#include "api/dds/cyclone_version.h"

static struct ddsi_domaingv* domain_of(dds_entity_t participant) {
  dds_guid_t guid;
  if (plc_unknown_cyclone() != NULL) return NULL;
  struct ddsi_domaingv* const domain = plc_domain_of_last_call();
  if (domain == NULL || dds_get_guid(participant, &guid) != DDS_RETCODE_OK) return NULL;
  struct thread_state* const thread = lookup_thread_state();
  const ddsi_guid_t its_guid = plc_in_host_order(&guid);
  thread_state_awake(thread, domain);
  const bool is_its = entidx_lookup_participant_guid(domain->entity_index, &its_guid) != NULL;
  thread_state_asleep(thread);
  return is_its ? domain : NULL;
}

bool plc_can_tell_addresses(dds_entity_t participant) {
  return domain_of(participant) != NULL;
}

typedef struct AddressList {
  plc_Address* addresses;
  size_t most;
  size_t count;
} AddressList;

static plc_Address address_of(const ddsi_xlocator_t* locator) {
  plc_Address result = {.kind = locator->c.kind, .port = locator->c.port};
  memcpy(result.octets, locator->c.address, sizeof result.octets);
  return result;
}

static void note_address(const ddsi_xlocator_t* locator, void* to) {
  AddressList* const list = to;
  if (list->count < list->most) list->addresses[list->count] = address_of(locator);
  ++list->count;
}

size_t plc_announced_addresses(dds_entity_t participant, plc_Address* addresses, size_t most) {
  struct ddsi_domaingv* const domain = domain_of(participant);
  AddressList list = {addresses, most, 0};
  if (domain != NULL) addrset_forall(domain->as_disc, note_address, &list);
  return list.count;
}

size_t plc_addresses_of(dds_entity_t participant, const dds_guid_t* remote, plc_Address* addresses,
                        size_t most) {
  struct ddsi_domaingv* const domain = domain_of(participant);
  AddressList list = {addresses, most, 0};
  if (domain == NULL) return 0;
  struct thread_state* const thread = lookup_thread_state();
  const ddsi_guid_t guid = plc_in_host_order(remote);
  thread_state_awake(thread, domain);
  const struct ddsi_proxy_participant* const known =
      entidx_lookup_proxy_participant_guid(domain->entity_index, &guid);
  if (known != NULL) addrset_forall(known->as_meta, note_address, &list);
  thread_state_asleep(thread);
  return list.count;
}

typedef struct Search {
  const plc_Address* address;
  ddsi_xlocator_t found;
  bool is_found;
} Search;

static void compare_address(const ddsi_xlocator_t* locator, void* to) {
  Search* const search = to;
  const plc_Address address = address_of(locator);
  if (memcmp(&address, search->address, sizeof address) != 0) return;
  search->found = *locator;
  search->is_found = true;
}

bool plc_stop_announcing_to(dds_entity_t participant, const plc_Address* address) {
  struct ddsi_domaingv* const domain = domain_of(participant);
  Search search = {.address = address};
  if (domain == NULL) return false;
  addrset_forall(domain->as_disc, compare_address, &search);
  if (search.is_found) remove_from_addrset(domain, domain->as_disc, &search.found);
  return search.is_found;
}

bool plc_announce_to(dds_entity_t participant, const dds_guid_t* remote, const plc_Address* address) {
  struct ddsi_domaingv* const domain = domain_of(participant);
  Search search = {.address = address};
  if (domain == NULL) return false;
  struct thread_state* const thread = lookup_thread_state();
  const ddsi_guid_t guid = plc_in_host_order(remote);
  thread_state_awake(thread, domain);
  const struct ddsi_proxy_participant* const known =
      entidx_lookup_proxy_participant_guid(domain->entity_index, &guid);
  if (known != NULL) addrset_forall(known->as_meta, compare_address, &search);
  if (search.is_found) add_xlocator_to_addrset(domain, domain->as_disc, &search.found);
  thread_state_asleep(thread);
  return search.is_found;
}
