#pragma once

#include <string_view>

#include "api/cli/rows/status_rows.hpp"
#include "api/dds/variable_page.hpp"

namespace plchost {

/// The application that declares a variable.
struct VariableOwner {
  std::string_view host;
  std::string_view instance;
};

/// The fields of the row of a variable that its record has not.
[[nodiscard]] dds::Computed<plc_VariableRecord, Row> computed_of(const plc_VariableRecord& variable,
                                                                 const VariableOwner& owner);

}  // namespace plchost
