#include "api/dds/handshakes.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "api/dds/cyclone_internals.h"
#include "api/dds/cyclone_version.h"

// Longer than the lease of a participant of ours and the second after which a message is repeated.
static const dds_duration_t kDoubt = DDS_SECS(5);

// A local participant, as its plugin calls it.
typedef struct Local {
  struct Local* next;
  DDS_Security_IdentityHandle handle;
  unsigned char prefix[PLC_GUID_PREFIX];
} Local;

// A local and a remote participant, from the first step of their handshake until one forgets the other.
typedef struct Pair {
  struct Pair* next;
  DDS_Security_IdentityHandle local;
  DDS_Security_IdentityHandle remote;
  DDS_Security_HandshakeHandle handshake;
  DDS_Security_GUID_t guid;  // of the remote one
  DDS_Security_IdentityToken token;
  bool has_asked;  // this side has sent its own challenge within the handshake
  unsigned char own[PLC_CHALLENGE];
  bool is_answered;  // this side has signed the remote one's challenge
  unsigned char challenge[PLC_CHALLENGE];
  bool is_done;              // the other side has answered the challenge of this one
  bool is_stuck;             // Cyclone has lost the message that it would repeat
  dds_time_t doubted_until;  // 0: it is not doubted
} Pair;

// The functions of the authentication plugin itself. A process has one plugin.
static struct {
  DDS_Security_authentication_validate_remote_identity validate_remote_identity;
  DDS_Security_authentication_begin_handshake_request begin_handshake_request;
  DDS_Security_authentication_begin_handshake_reply begin_handshake_reply;
  DDS_Security_authentication_process_handshake process_handshake;
  DDS_Security_authentication_return_identity_handle return_identity_handle;
} plugin;

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static Local* locals;
static Pair* pairs;
static atomic_int doubted;  // number of doubted pairs; 0: no need to take the mutex

// With the mutex.
static Pair* pair_of(DDS_Security_IdentityHandle local, DDS_Security_IdentityHandle remote) {
  Pair* pair = pairs;
  while (pair != NULL && (pair->local != local || pair->remote != remote)) pair = pair->next;
  return pair;
}

// With the mutex.
static void doubt(Pair* pair) {
  if (pair->doubted_until == 0) atomic_fetch_add(&doubted, 1);
  pair->doubted_until = ddsrt_time_monotonic().v + kDoubt;
}

// With the mutex.
static void trust(Pair* pair) {
  if (pair->doubted_until != 0) atomic_fetch_sub(&doubted, 1);
  pair->doubted_until = 0;
}

static void note_begin(DDS_Security_IdentityHandle local, DDS_Security_IdentityHandle remote,
                       const DDS_Security_IdentityToken* token, const DDS_Security_GUID_t* guid) {
  pthread_mutex_lock(&mutex);
  if (pair_of(local, remote) == NULL) {
    Pair* const pair = calloc(1, sizeof *pair);
    if (pair != NULL) {
      *pair = (Pair){.next = pairs, .local = local, .remote = remote, .guid = *guid};
      DDS_Security_DataHolder_copy(&pair->token, token);
      pairs = pair;
    }
  }
  pthread_mutex_unlock(&mutex);
}

static const unsigned char* challenge_in(const DDS_Security_HandshakeMessageToken* message,
                                         const char* name) {
  const DDS_Security_BinaryProperty_t* const property =
      DDS_Security_DataHolder_find_binary_property(message, name);
  if (property == NULL || property->value._length != PLC_CHALLENGE) return NULL;
  return property->value._buffer;
}

static void note_handshake(DDS_Security_IdentityHandle local, DDS_Security_IdentityHandle remote,
                           DDS_Security_HandshakeHandle handshake, const unsigned char* own) {
  pthread_mutex_lock(&mutex);
  Pair* const pair = own == NULL ? NULL : pair_of(local, remote);
  if (pair != NULL) {
    pair->handshake = handshake;
    pair->has_asked = true;
    pair->is_done = false;
    memcpy(pair->own, own, sizeof pair->own);
  }
  pthread_mutex_unlock(&mutex);
}

static void note_answer(DDS_Security_IdentityHandle local, DDS_Security_IdentityHandle remote,
                        const unsigned char* challenge) {
  pthread_mutex_lock(&mutex);
  Pair* const pair = challenge == NULL ? NULL : pair_of(local, remote);
  if (pair != NULL) {
    pair->is_answered = true;
    memcpy(pair->challenge, challenge, sizeof pair->challenge);
    pair->is_stuck = false;
    trust(pair);
  }
  pthread_mutex_unlock(&mutex);
}

static void note_success(DDS_Security_IdentityHandle local, DDS_Security_IdentityHandle remote) {
  pthread_mutex_lock(&mutex);
  Pair* const pair = pair_of(local, remote);
  if (pair != NULL) pair->is_done = true;
  pthread_mutex_unlock(&mutex);
}

// A message was refused. Cyclone does not repeat its own one any more. A reply that is good may follow. After
// a last message nothing does.
static void note_failure(DDS_Security_IdentityHandle local, DDS_Security_IdentityHandle remote,
                         bool is_last) {
  pthread_mutex_lock(&mutex);
  Pair* const pair = pair_of(local, remote);
  if (pair != NULL) {
    pair->is_stuck = true;
    if (is_last) doubt(pair);
  }
  pthread_mutex_unlock(&mutex);
}

// The plugin takes another challenge of the remote participant only with a request for authentication that
// says so. Cyclone does not give it one once a handshake has begun.
static void take_challenge(dds_security_authentication* instance, DDS_Security_IdentityHandle local,
                           DDS_Security_IdentityHandle remote, const unsigned char* challenge) {
  char name[] = "future_challenge";
  char class_id[] = DDS_SECURITY_AUTH_REQUEST_TOKEN_CLASS_ID;
  unsigned char value[PLC_CHALLENGE];
  DDS_Security_BinaryProperty_t property = {
      .name = name, .value = {sizeof value, sizeof value, value}, .propagate = true};
  const DDS_Security_AuthRequestMessageToken request = {.class_id = class_id,
                                                        .binary_properties = {1, 1, &property}};
  DDS_Security_IdentityToken token = {0};
  DDS_Security_GUID_t guid = {0};
  if (challenge == NULL) return;
  memcpy(value, challenge, sizeof value);
  pthread_mutex_lock(&mutex);
  const Pair* const pair = pair_of(local, remote);
  if (pair != NULL) {
    guid = pair->guid;
    DDS_Security_DataHolder_copy(&token, &pair->token);
  }
  pthread_mutex_unlock(&mutex);
  if (pair == NULL) return;
  DDS_Security_AuthRequestMessageToken unused = {0};
  DDS_Security_IdentityHandle same = DDS_SECURITY_HANDLE_NIL;
  DDS_Security_SecurityException error = {0};
  const DDS_Security_ValidationResult_t result =
      plugin.validate_remote_identity(instance, &same, &unused, &request, local, &token, &guid, &error);
  DDS_Security_Exception_reset(&error);
  // Another thread has returned the handle meanwhile, so the plugin has made one that nobody else returns.
  if (result != DDS_SECURITY_VALIDATION_FAILED && same != remote) {
    (void)plugin.return_identity_handle(instance, same, &error);
    DDS_Security_Exception_reset(&error);
  }
  DDS_Security_DataHolder_deinit(&unused);
  DDS_Security_DataHolder_deinit(&token);
}

// Cyclone reads the pointer to a function of ours without an order. So each of these reads it once more: then
// what put_in_front() kept before is seen, on any processor.
#define SEE_PLUGIN(function) (void)__atomic_load_n(&instance->function, __ATOMIC_ACQUIRE)

static DDS_Security_ValidationResult_t validate_remote_identity(
    dds_security_authentication* instance, DDS_Security_IdentityHandle* remote,
    DDS_Security_AuthRequestMessageToken* local_request,
    const DDS_Security_AuthRequestMessageToken* remote_request, const DDS_Security_IdentityHandle local,
    const DDS_Security_IdentityToken* token, const DDS_Security_GUID_t* guid,
    DDS_Security_SecurityException* error) {
  SEE_PLUGIN(validate_remote_identity);
  const DDS_Security_ValidationResult_t result = plugin.validate_remote_identity(
      instance, remote, local_request, remote_request, local, token, guid, error);
  if (result != DDS_SECURITY_VALIDATION_FAILED) note_begin(local, *remote, token, guid);
  return result;
}

static DDS_Security_ValidationResult_t begin_handshake_request(dds_security_authentication* instance,
                                                               DDS_Security_HandshakeHandle* handshake,
                                                               DDS_Security_HandshakeMessageToken* message,
                                                               const DDS_Security_IdentityHandle local,
                                                               const DDS_Security_IdentityHandle remote,
                                                               const DDS_Security_OctetSeq* participant_data,
                                                               DDS_Security_SecurityException* error) {
  SEE_PLUGIN(begin_handshake_request);
  const DDS_Security_ValidationResult_t result =
      plugin.begin_handshake_request(instance, handshake, message, local, remote, participant_data, error);
  if (result != DDS_SECURITY_VALIDATION_FAILED) {
    note_handshake(local, remote, *handshake, challenge_in(message, "challenge1"));
  }
  return result;
}

static DDS_Security_ValidationResult_t begin_handshake_reply(
    dds_security_authentication* instance, DDS_Security_HandshakeHandle* handshake,
    DDS_Security_HandshakeMessageToken* reply, const DDS_Security_HandshakeMessageToken* request,
    const DDS_Security_IdentityHandle remote, const DDS_Security_IdentityHandle local,
    const DDS_Security_OctetSeq* participant_data, DDS_Security_SecurityException* error) {
  SEE_PLUGIN(begin_handshake_reply);
  const unsigned char* const challenge = challenge_in(request, "challenge1");
  take_challenge(instance, local, remote, challenge);
  const DDS_Security_ValidationResult_t result = plugin.begin_handshake_reply(
      instance, handshake, reply, request, remote, local, participant_data, error);
  if (result != DDS_SECURITY_VALIDATION_FAILED) {
    note_handshake(local, remote, *handshake, challenge_in(reply, "challenge2"));
    note_answer(local, remote, challenge);
  }
  return result;
}

static DDS_Security_ValidationResult_t process_handshake(dds_security_authentication* instance,
                                                         DDS_Security_HandshakeMessageToken* answer,
                                                         const DDS_Security_HandshakeMessageToken* message,
                                                         const DDS_Security_HandshakeHandle handshake,
                                                         DDS_Security_SecurityException* error) {
  SEE_PLUGIN(process_handshake);
  DDS_Security_IdentityHandle local = DDS_SECURITY_HANDLE_NIL;
  DDS_Security_IdentityHandle remote = DDS_SECURITY_HANDLE_NIL;
  pthread_mutex_lock(&mutex);
  for (const Pair* pair = pairs; pair != NULL; pair = pair->next) {
    if (pair->handshake != handshake) continue;
    local = pair->local;
    remote = pair->remote;
  }
  pthread_mutex_unlock(&mutex);
  // The last message of a handshake must have the challenge that was answered.
  const bool is_reply =
      message->class_id != NULL && strcmp(message->class_id, DDS_SECURITY_AUTH_HANDSHAKE_REPLY_TOKEN_ID) == 0;
  const unsigned char* const challenge = is_reply ? challenge_in(message, "challenge2") : NULL;
  take_challenge(instance, local, remote, challenge);
  const DDS_Security_ValidationResult_t result =
      plugin.process_handshake(instance, answer, message, handshake, error);
  if (result == DDS_SECURITY_VALIDATION_FAILED) {
    note_failure(local, remote, !is_reply);
  } else {
    note_success(local, remote);
    note_answer(local, remote, challenge);
  }
  return result;
}

static void forget_identity(DDS_Security_IdentityHandle handle) {
  pthread_mutex_lock(&mutex);
  for (Pair** at = &pairs; *at != NULL;) {
    Pair* const pair = *at;
    if (pair->local != handle && pair->remote != handle) {
      at = &pair->next;
      continue;
    }
    *at = pair->next;
    trust(pair);
    DDS_Security_DataHolder_deinit(&pair->token);
    free(pair);
  }
  for (Local** at = &locals; *at != NULL;) {
    Local* const local = *at;
    if (local->handle != handle) {
      at = &local->next;
      continue;
    }
    *at = local->next;
    free(local);
  }
  pthread_mutex_unlock(&mutex);
}

static DDS_Security_boolean return_identity_handle(dds_security_authentication* instance,
                                                   const DDS_Security_IdentityHandle handle,
                                                   DDS_Security_SecurityException* error) {
  SEE_PLUGIN(return_identity_handle);
  // Before, because the plugin may give the same handle to another one right afterwards.
  forget_identity(handle);
  return plugin.return_identity_handle(instance, handle, error);
}

#undef SEE_PLUGIN

// With the mutex. The threads of Cyclone read these pointers at each call. Several domains have one plugin,
// so one that begins changes nothing for the others.
static void put_in_front(dds_security_authentication* instance) {
#define KEEP(function) \
  if (plugin.function != instance->function) plugin.function = instance->function
#define PUT_IN_FRONT(function) __atomic_store_n(&instance->function, function, __ATOMIC_RELEASE)
  if (instance->begin_handshake_reply == begin_handshake_reply) return;
  // All of them first: one of ours calls several of the plugin.
  KEEP(validate_remote_identity);
  KEEP(begin_handshake_request);
  KEEP(begin_handshake_reply);
  KEEP(process_handshake);
  KEEP(return_identity_handle);
  PUT_IN_FRONT(validate_remote_identity);
  PUT_IN_FRONT(begin_handshake_request);
  PUT_IN_FRONT(begin_handshake_reply);
  PUT_IN_FRONT(process_handshake);
  PUT_IN_FRONT(return_identity_handle);
#undef KEEP
#undef PUT_IN_FRONT
}

bool plc_watch_handshakes(dds_entity_t participant) {
  dds_guid_t guid;
  if (plc_unknown_cyclone() != NULL || dds_get_guid(participant, &guid) != DDS_RETCODE_OK) return false;
  struct ddsi_domaingv* const domain = plc_domain_of_last_call();
  Local* const local = domain == NULL ? NULL : calloc(1, sizeof *local);
  if (local == NULL) return false;
  memcpy(local->prefix, guid.v, sizeof local->prefix);
  const ddsi_guid_t its_guid = plc_in_host_order(&guid);
  struct thread_state* const thread = lookup_thread_state();
  thread_state_awake(thread, domain);
  const struct ddsi_participant* const its = entidx_lookup_participant_guid(domain->entity_index, &its_guid);
  dds_security_authentication* const instance =
      its == NULL ? NULL : q_omg_participant_get_authentication(its);
  const bool is_secured = instance != NULL && its->sec_attr != NULL;
  if (is_secured) {
    local->handle = its->sec_attr->local_identity_handle;
    pthread_mutex_lock(&mutex);
    local->next = locals;
    locals = local;
    put_in_front(instance);
    pthread_mutex_unlock(&mutex);
  }
  thread_state_asleep(thread);
  if (!is_secured) free(local);
  return is_secured;
}

// With the mutex.
static bool is_to(const Pair* pair, const unsigned char* prefix) {
  for (const Local* local = locals; local != NULL; local = local->next) {
    if (local->handle == pair->local) return memcmp(local->prefix, prefix, sizeof local->prefix) == 0;
  }
  return false;
}

plc_SignUse plc_take_sign(const plc_HandshakeSign* sign) {
  plc_SignUse use = PLC_SIGN_OF_USE;
  pthread_mutex_lock(&mutex);
  for (Pair* pair = pairs; pair != NULL; pair = pair->next) {
    if (memcmp(pair->guid.prefix, sign->from, PLC_GUID_PREFIX) != 0 || !is_to(pair, sign->to)) continue;
    const bool begins = sign->answered == NULL;
    if (!begins && pair->has_asked && memcmp(pair->own, sign->answered, PLC_CHALLENGE) != 0) {
      use = PLC_SIGN_OF_NO_USE;
    } else if ((begins && pair->is_stuck) ||
               (pair->is_answered && memcmp(pair->challenge, sign->challenge, PLC_CHALLENGE) != 0)) {
      doubt(pair);
    } else if (!begins && pair->has_asked && pair->is_answered && !pair->is_stuck && !pair->is_done) {
      use = PLC_SIGN_AWAITED;
    }
  }
  pthread_mutex_unlock(&mutex);
  return use;
}

bool plc_is_doubted(const unsigned char* from) {
  if (atomic_load(&doubted) == 0) return false;
  bool result = false;
  pthread_mutex_lock(&mutex);
  const dds_time_t now = ddsrt_time_monotonic().v;
  for (Pair* pair = pairs; pair != NULL; pair = pair->next) {
    if (pair->doubted_until == 0) continue;
    if (pair->doubted_until <= now) {
      trust(pair);
    } else {
      result |= memcmp(pair->guid.prefix, from, PLC_GUID_PREFIX) == 0;
    }
  }
  pthread_mutex_unlock(&mutex);
  return result;
}
