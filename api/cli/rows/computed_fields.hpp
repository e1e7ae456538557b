#pragma once

#include <control.h>
#include <status_fields.hpp>

#include "api/cli/rows/table.hpp"

namespace plchost {

// The fields of rows that `row:` of control.idl calls computed: no member has them by itself. Hosts:
// host_rows.hpp.

/// `stopped`: the application or the task; empty for an instance that never had an exception.
[[nodiscard]] dds::Computed<plc_ExceptionStatus, Row> computed_of(const plc_ExceptionStatus& status);

/// The words of both states depend on whose they are.
[[nodiscard]] dds::Computed<plc_Transition, Row> computed_of(const plc_Transition& transition);

/// `loaded`: it is what the instance has loaded, which another topic tells. The file of an application that
/// was not sent is its path. A table shows the beginning of the digest, and marks what is loaded and what is
/// the boot application.
[[nodiscard]] dds::Computed<plc_ApplicationStatus, Row> computed_of(const plc_ApplicationStatus& status,
                                                                    bool loaded);

/// The times of the last loss are from its planned release; null if no cycle had run before.
[[nodiscard]] dds::Computed<plc_TaskStatistics, Row> computed_of(const plc_TaskStatistics& numbers);

}  // namespace plchost
