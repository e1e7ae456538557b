#pragma once

#include <optional>

#include "api/cli/rows/status_rows.hpp"
#include "api/client/control_client.hpp"

namespace plchost {

/// A host as it was seen last; `clock`: its present time, if that is known.
[[nodiscard]] Row to_row(const HostView& host, const std::optional<ClockOffset>& clock);

/// The fields of that row that its status does not have by itself. Its presence shows its server, and whether
/// it is silent; its time comes from a question, counts from a list. `problem` is the worst of several
/// members, `load` is in processors, and times are in seconds.
[[nodiscard]] dds::Computed<plc_HostStatus, Row> computed_of(const plc_HostStatus& status,
                                                             const HostView& host,
                                                             const std::optional<ClockOffset>& clock);

}  // namespace plchost
