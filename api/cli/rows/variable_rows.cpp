#include "api/cli/rows/variable_rows.hpp"

namespace plchost {

dds::Computed<plc_VariableRecord, Row> computed_of(const plc_VariableRecord& /*variable*/,
                                                   std::string_view host, std::string_view instance) {
  return {.host = host, .instance = instance};
}

}  // namespace plchost
