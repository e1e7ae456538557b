#include "api/dds/secured_announcement.h"

#include <dds/ddsi/ddsi_participant.h>
#include <dds/ddsi/ddsi_plist.h>

#include "api/dds/cyclone_internals.h"
#include "api/dds/cyclone_version.h"

// The last sample of a writer, if its history keeps it.
static struct ddsi_serdata* last_of(struct ddsi_writer* writer) {
  struct whc_borrowed_sample sample;
  struct ddsi_serdata* last = NULL;
  ddsrt_mutex_lock(&writer->e.lock);
  if (whc_borrow_sample(writer->whc, writer->seq, &sample)) {
    last = ddsi_serdata_ref(sample.serdata);
    whc_return_sample(writer->whc, &sample, false);
  }
  ddsrt_mutex_unlock(&writer->e.lock);
  return last;
}

// The same, as a sample of another writer's type. Takes `data` over.
static struct ddsi_serdata* translate(struct ddsi_serdata* data, const struct ddsi_writer* writer) {
  struct ddsi_serdata* result = NULL;
  ddsi_plist_t parameters;
  if (ddsi_serdata_to_sample(data, &parameters, NULL, NULL)) {
    result = ddsi_serdata_from_sample(writer->type, SDK_DATA, &parameters);
    ddsi_plist_fini(&parameters);
  }
  if (result != NULL) {
    result->statusinfo = 0;
    result->timestamp = data->timestamp;
  }
  ddsi_serdata_unref(data);
  return result;
}

// The writer itself cannot be asked to write: that function is not exported. Each reader that it meets asks
// for what its history has, as for everything that was written before. Takes `data` over.
static bool put_into_history(struct ddsi_domaingv* domain, struct ddsi_writer* writer,
                             struct ddsi_serdata* data) {
  bool is_in = false;
  struct ddsi_tkmap_instance* const instance = ddsi_tkmap_lookup_instance_ref(domain->m_tkmap, data);
  ddsrt_mutex_lock(&writer->e.lock);
  if (writer->state == WRST_OPERATIONAL && writer->seq == 0) {
    data->twrite = ddsrt_time_monotonic();
    ++writer->seq;
    ddsi_writer_update_seq_xmit(writer, writer->seq);  // only what was sent once is sent again
    is_in = whc_insert(writer->whc, writer->seq, writer->seq, DDSRT_MTIME_NEVER, NULL, data, instance) == 0;
  }
  ddsrt_mutex_unlock(&writer->e.lock);
  ddsi_tkmap_instance_unref(domain->m_tkmap, instance);
  ddsi_serdata_unref(data);
  return is_in;
}

static bool announce(struct ddsi_domaingv* domain, const ddsi_guid_t* guid) {
  const struct ddsi_participant* const participant =
      entidx_lookup_participant_guid(domain->entity_index, guid);
  if (participant == NULL) return false;
  ddsi_guid_t secured_writer = *guid;
  secured_writer.entityid.u = NN_ENTITYID_SPDP_RELIABLE_BUILTIN_PARTICIPANT_SECURE_WRITER;
  struct ddsi_writer* const secured = entidx_lookup_writer_guid(domain->entity_index, &secured_writer);
  struct ddsi_writer* const plain =
      ddsi_get_builtin_writer(participant, NN_ENTITYID_SPDP_BUILTIN_PARTICIPANT_WRITER);
  if (secured == NULL || plain == NULL) return false;
  struct ddsi_serdata* const last = last_of(plain);
  struct ddsi_serdata* const announcement = last == NULL ? NULL : translate(last, secured);
  return announcement != NULL && put_into_history(domain, secured, announcement);
}

// For Cyclone: whether it sends the sample to that reader. Instead of the others it says that they do not
// come.
static int is_end(struct ddsi_writer* writer, struct ddsi_proxy_reader* reader, struct ddsi_serdata* data) {
  (void)writer;
  (void)reader;
  return data->statusinfo != 0;
}

bool plc_spare_announcement(dds_entity_t participant, const dds_guid_t* remote) {
  dds_guid_t guid;
  if (plc_unknown_cyclone() != NULL || dds_get_guid(participant, &guid) != DDS_RETCODE_OK) return false;
  struct ddsi_domaingv* const domain = plc_domain_of_last_call();
  if (domain == NULL) return false;
  const ddsi_guid_t own = plc_in_host_order(&guid);
  ddsi_guid_t its_reader = plc_in_host_order(remote);
  its_reader.entityid.u = NN_ENTITYID_SPDP_RELIABLE_BUILTIN_PARTICIPANT_SECURE_READER;
  struct thread_state* const thread = lookup_thread_state();
  thread_state_awake(thread, domain);
  const bool is_here = entidx_lookup_participant_guid(domain->entity_index, &own) != NULL;
  struct ddsi_proxy_reader* const reader =
      is_here ? entidx_lookup_proxy_reader_guid(domain->entity_index, &its_reader) : NULL;
  const bool is_spared = reader != NULL && vendor_is_eclipse(reader->c.vendor);
  // The threads of Cyclone read this pointer when the reader asks for a sample.
  if (is_spared) __atomic_store_n(&reader->filter, is_end, __ATOMIC_RELEASE);
  thread_state_asleep(thread);
  return is_spared;
}

bool plc_announce_secured(dds_entity_t participant) {
  dds_guid_t guid;
  // This thread has made the participant, or its GUID would not be found in the domain.
  if (plc_unknown_cyclone() != NULL || dds_get_guid(participant, &guid) != DDS_RETCODE_OK) return false;
  struct ddsi_domaingv* const domain = plc_domain_of_last_call();
  if (domain == NULL) return false;
  const ddsi_guid_t its_guid = plc_in_host_order(&guid);
  struct thread_state* const thread = lookup_thread_state();
  thread_state_awake(thread, domain);
  const bool is_announced = announce(domain, &its_guid);
  thread_state_asleep(thread);
  return is_announced;
}
