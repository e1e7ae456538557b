#include "api/cli/rows/variable_rows.hpp"

namespace plchost {

dds::Computed<plc_VariableRecord, Row> computed_of(const plc_VariableRecord& /*variable*/,
                                                   const VariableOwner& owner) {
  return {.host = owner.host, .instance = owner.instance};
}

}  // namespace plchost
