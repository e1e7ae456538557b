#include "api/cli/rows/variable_rows.hpp"

#include "api/dds/text.hpp"

namespace plchost {

dds::Computed<plc_VariableRecord, Row> computed_of(const plc_VariableRecord& /*variable*/,
                                                   const VariableOwner& owner) {
  return {.host = owner.host, .instance = owner.instance};
}

void mark_forced_arrays(std::vector<Row>& rows) {
  for (Row& row : rows) {
    if (row.at("forced") == true && row.at("forced_value").is_null()) row["forced_value"] = "elements";
  }
}

std::string_view forced_text(const plc_VariableRecord& variable) {
  if (!variable.forced) return "";
  return dds::text_of(variable.forced_value).empty() ? "elements forced" : "forced";
}

bool is_program(const plc_VariableRecord& variable) noexcept {
  return dds::text_of(variable.area) == "program" && dds::text_of(variable.type).starts_with("STRING");
}

}  // namespace plchost
