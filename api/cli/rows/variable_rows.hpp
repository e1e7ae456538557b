#pragma once

#include <string_view>

#include "api/cli/rows/status_rows.hpp"
#include "api/dds/variable_page.hpp"

namespace plchost {

/// The fields of the row of a variable that its record has not.
[[nodiscard]] dds::Computed<plc_VariableRecord, Row> computed_of(const plc_VariableRecord& variable,
                                                                 std::string_view host,
                                                                 std::string_view instance);

}  // namespace plchost
