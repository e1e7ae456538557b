#include "api/dds/signed_messages.h"

#include <stdatomic.h>

#include "api/dds/cyclone_internals.h"
#include "api/dds/cyclone_version.h"

// Of the plugin itself. A process has one plugin.
static _Atomic(DDS_Security_crypto_transform_decode_rtps_message) decode_for_one;

// Cyclone calls it for one participant after the other, with the same `plain`, which is empty at first.
static DDS_Security_boolean decode_once(dds_security_crypto_transform* instance, DDS_Security_OctetSeq* plain,
                                        const DDS_Security_OctetSeq* encoded,
                                        const DDS_Security_ParticipantCryptoHandle receiver,
                                        const DDS_Security_ParticipantCryptoHandle sender,
                                        DDS_Security_SecurityException* error) {
  if (plain->_buffer != NULL) return true;
  const DDS_Security_crypto_transform_decode_rtps_message decode = atomic_load(&decode_for_one);
  if (decode(instance, plain, encoded, receiver, sender, error)) return true;
  // With this error Cyclone goes on to the next participant.
  DDS_Security_Exception_reset(error);
  error->code = DDS_SECURITY_ERR_INVALID_CRYPTO_RECEIVER_SIGN_CODE;
  return false;
}

bool plc_decode_signed_once(dds_entity_t participant) {
  dds_guid_t guid;
  if (plc_unknown_cyclone() != NULL || dds_get_guid(participant, &guid) != DDS_RETCODE_OK) return false;
  struct ddsi_domaingv* const domain = plc_domain_of_last_call();
  if (domain == NULL) return false;
  const ddsi_guid_t its_guid = plc_in_host_order(&guid);
  struct thread_state* const thread = lookup_thread_state();
  thread_state_awake(thread, domain);
  const struct ddsi_participant* const its = entidx_lookup_participant_guid(domain->entity_index, &its_guid);
  const dds_security_cryptography* const security =
      its == NULL ? NULL : q_omg_participant_get_cryptography(its);
  if (security != NULL && security->crypto_transform->decode_rtps_message != decode_once) {
    atomic_store(&decode_for_one, security->crypto_transform->decode_rtps_message);
    // The threads of Cyclone read this pointer at each message.
    __atomic_store_n(&security->crypto_transform->decode_rtps_message, decode_once, __ATOMIC_RELEASE);
  }
  thread_state_asleep(thread);
  return security != NULL;
}
