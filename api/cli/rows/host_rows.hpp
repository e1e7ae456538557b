#pragma once

#include <optional>
#include <vector>

#include "api/cli/rows/table.hpp"
#include "api/client/control_client.hpp"

namespace plchost {

/// A host as it was seen last; `clock`: its present time, if that is known.
[[nodiscard]] Row to_row(const HostView& host, const std::optional<ClockOffset>& clock);
[[nodiscard]] const std::vector<Column>& host_columns();

}  // namespace plchost
