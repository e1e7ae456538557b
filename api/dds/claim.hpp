#pragma once

#include <string>

#include "api/dds/qos.hpp"

namespace plchost::dds {

/// Of a participant that says what its process is, "plcctl 4711, user 1000, on cell3": a claim for the log of
/// others, not a proof.
[[nodiscard]] Qos client_participant_qos();
/// The claim of a participant, as it was discovered. Empty: nothing, or what cannot be printed.
[[nodiscard]] std::string claim_of(const dds_qos_t* qos);

}  // namespace plchost::dds
