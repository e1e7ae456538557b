#pragma once

#include <dds/dds.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

// The memory of handshakes of DDS Security, for Cyclone DDS 0.10.2 to 0.10.5. Two participants can lose each
// other at different times: one drops the other when its lease ends, and later begins a handshake with a new
// challenge. The other one received plain announcements all the time. It has its old keys, or waits with its
// old challenge, and Cyclone alone never leaves that state: neither decodes the other's messages.
//
// The memory ends that in three ways:
// - A handshake that is not complete takes the newest challenge of the other side. Cyclone keeps the first
//   one. The signature over both challenges is checked as before.
// - An answer to another challenge than this side's own is not processed. Cyclone refuses it, too, but then
//   never repeats the message that the other side waits for.
// - If the other side uses a challenge that is not the one that this side has answered, it has begun anew, or
//   a stranger says so. For 5 s its plain messages are ignored. So the lease ends unless protected
//   messages come, and this side begins anew, too. The answer that completes a handshake passes all the same:
//   it has both challenges, which a stranger cannot guess. It does not end the 5 s.
// A process with several participants has one lease for a remote participant. Messages to one of its own
// participants keep that lease for all.

enum { PLC_GUID_PREFIX = 12, PLC_CHALLENGE = 32 };

/// From now on, the handshakes of `participant`, which this thread has just made, are remembered. False: it
/// is not secured, or the release of Cyclone is not known.
bool plc_watch_handshakes(dds_entity_t participant);

/// The contents of a message of a handshake, which is in plain text.
typedef struct plc_HandshakeSign {
  const unsigned char* from;       ///< the sender, by its GUID prefix
  const unsigned char* to;         ///< a participant of this process
  const unsigned char* challenge;  ///< the sender's own
  const unsigned char* answered;   ///< the challenge that it answers; NULL: none
} plc_HandshakeSign;

typedef enum plc_SignUse {
  PLC_SIGN_OF_NO_USE,  ///< Cyclone must not see the message
  PLC_SIGN_OF_USE,     ///< Cyclone may see it unless its sender is doubted
  PLC_SIGN_AWAITED     ///< it answers both challenges of a handshake that is not complete
} plc_SignUse;

/// Takes a message of a handshake into account. Any thread.
plc_SignUse plc_take_sign(const plc_HandshakeSign* sign);

/// Whether plain messages of the remote participant are worth nothing now. Any thread.
bool plc_is_doubted(const unsigned char* from);

#ifdef __cplusplus
}
#endif
