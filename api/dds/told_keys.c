#include "api/dds/told_keys.h"

#include "api/dds/cyclone_internals.h"
#include "api/dds/cyclone_version.h"

// All that was written for this one has come. One that has never answered, or has stopped to, is not counted.
static bool has_its_keys(const struct ddsi_wr_prd_match* match) {
  return match->has_replied_to_hb && match->seq != MAX_SEQ_NUMBER && match->seq >= match->last_seq;
}

// With the writer's lock.
static seqno_t acknowledge_those_for_others(struct ddsi_writer* writer) {
  for (struct ddsi_wr_prd_match* match = ddsrt_avl_find_min(&ddsi_wr_readers_treedef, &writer->readers);
       match != NULL; match = ddsrt_avl_find_succ(&ddsi_wr_readers_treedef, &writer->readers, match)) {
    if (!has_its_keys(match) || match->seq >= writer->seq) continue;
    match->seq = writer->seq;
    ddsrt_avl_augment_update(&ddsi_wr_readers_treedef, match);
  }
  const struct ddsi_wr_prd_match* const root = ddsrt_avl_root(&ddsi_wr_readers_treedef, &writer->readers);
  return root == NULL || root->min_seq == MAX_SEQ_NUMBER ? writer->seq : root->min_seq;
}

static uint32_t forget(struct ddsi_writer* writer) {
  struct whc_node* unneeded = NULL;
  struct whc_state kept;
  uint32_t count = 0;
  ddsrt_mutex_lock(&writer->e.lock);
  whc_get_state(writer->whc, &kept);
  if (!WHCST_ISEMPTY(&kept) && writer->state == WRST_OPERATIONAL) {
    const seqno_t last_unneeded = acknowledge_those_for_others(writer);
    count = whc_remove_acked_messages(writer->whc, last_unneeded, &kept, &unneeded);
  }
  ddsrt_mutex_unlock(&writer->e.lock);
  whc_free_deferred_free_list(writer->whc, unneeded);
  return count;
}

uint32_t plc_forget_told_keys(dds_entity_t reader) {
  dds_guid_t guid;
  // The first one for the sake of the domain.
  if (plc_unknown_cyclone() != NULL || dds_get_matched_publications(reader, NULL, 0) < 0 ||
      dds_get_guid(reader, &guid) != DDS_RETCODE_OK) {
    return 0;
  }
  struct ddsi_domaingv* const domain = plc_domain_of_last_call();
  struct thread_state* const thread = lookup_thread_state();
  ddsi_guid_t writer_of_keys = plc_in_host_order(&guid);
  writer_of_keys.entityid.u = NN_ENTITYID_P2P_BUILTIN_PARTICIPANT_VOLATILE_SECURE_WRITER;
  uint32_t result = 0;
  thread_state_awake(thread, domain);
  struct ddsi_writer* const known = entidx_lookup_writer_guid(domain->entity_index, &writer_of_keys);
  if (known != NULL) result = forget(known);
  thread_state_asleep(thread);
  return result;
}
