#pragma once

#include <dds/dds.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Frees the keys that a participant of a secured domain has told others, and that are kept without need.
/// Returns how many messages these were. 0 in an unsecured domain.
///
/// A participant tells each other one the keys of its readers and writers by one builtin writer, which keeps
/// a message until all that it knows have acknowledged its number. But a message is for one of them, and
/// Cyclone DDS 0.10.2 to 0.10.5 asks only that one. The others acknowledge its number only after a later
/// message for themselves. So one participant that stays, and is told nothing new, holds what all that come
/// and go were told: some 13 kB for each client. Here a reader that has acknowledged the last message for
/// itself counts as having acknowledged those for others, too. Messages that are still under way are kept.
///
/// `reader`: of that participant. Any thread. Takes time with the number of participants that are there, if
/// messages are kept.
uint32_t plc_forget_told_keys(dds_entity_t reader);

#ifdef __cplusplus
}
#endif
