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

/// The first line of a recording as CSV, and the line of each sample, as RFC 4180 has it. The last column
/// has the names of those that are forced, with blanks between, so that each other one has values alone.
[[nodiscard]] std::string recording_head(const VariableListing& sample);
[[nodiscard]] std::string recording_line(const VariableListing& sample);

}  // namespace plchost
