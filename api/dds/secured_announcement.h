#pragma once

#include <dds/dds.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Publishes a secured participant's announcement also by its secured writer, once for all participants that
/// discover it.
///
/// DDS Security asks for that (1.1, chapter 7.4.1.6). Cyclone DDS 0.10.2 to 0.10.5 has the writer, and uses
/// it for the end of the participant only. Fast DDS 3 authenticates a participant by its plain announcement,
/// and matches its readers and writers only after the secured one.
///
/// Call it right after the participant was made, in the same thread: no participant is authenticated yet, and
/// the announcement is the first sample of its writer. False: the participant is not secured, or the release
/// of Cyclone is not known.
bool plc_announce_secured(dds_entity_t participant);

/// The secured announcement of `participant` is not sent to the remote participant if that is one of Cyclone
/// DDS, which has no use for it. Call it when the remote one is discovered, in
/// a thread whose last call of DDS was to the domain of `participant`.
///
/// Cyclone DDS 0.10 takes the sample as it takes a plain announcement, and does not note that it has come.
/// So its reader would ask for the sample again each millisecond, for as long as both are there.
/// False: the remote participant is not secured, not known, or of another vendor.
bool plc_spare_announcement(dds_entity_t participant, const dds_guid_t* remote);

#ifdef __cplusplus
}
#endif
