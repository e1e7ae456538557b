#pragma once

#include <string>
#include <string_view>
#include <vector>

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

/// Fills in the column FORCED of a table for whole arrays: they have no one value that they are forced to.
void mark_forced_arrays(std::vector<Row>& rows);

/// For a person, beside the value: "forced", or of a whole array "elements forced". Empty: it is not.
[[nodiscard]] std::string_view forced_text(const plc_VariableRecord& variable);

/// A variable that stands for a program: it has the name of the program, and the text of its type. See
/// instances/plc_variables.h.
[[nodiscard]] bool is_program(const plc_VariableRecord& variable) noexcept;

}  // namespace plchost
