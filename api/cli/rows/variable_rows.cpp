#include "api/cli/rows/variable_rows.hpp"

#include <fmt/format.h>

#include "api/cli/rows/rows.hpp"
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

std::string recording_head(const VariableListing& sample) {
  std::string head = "time,time_unix_ns,consistent";
  for (const plc_VariableRecord& variable : sample.variables)
    head += "," + csv_cell(dds::text_of(variable.name));
  return head + ",forced";
}

std::string recording_line(const VariableListing& sample) {
  std::string line =
      fmt::format("{},{},{}", time_text(sample.time_unix_ns), sample.time_unix_ns, sample.consistent);
  std::string forced;
  for (const plc_VariableRecord& variable : sample.variables) {
    line += "," + csv_cell(dds::text_of(variable.value));
    if (variable.forced) forced.append(forced.empty() ? "" : " ").append(dds::text_of(variable.name));
  }
  return line + "," + csv_cell(forced);
}

}  // namespace plchost
