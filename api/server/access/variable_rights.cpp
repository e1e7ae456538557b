#include "api/server/access/variable_rights.hpp"

#include <fmt/format.h>

namespace plchost {

Result<void> VariableRights::check(OperationRight right, const AccessGuard& guard,
                                   const dds::Guid& writer) const {
  if (right == OperationRight::none) return {};
  const bool reads = right == OperationRight::read_variables;
  auto may = guard.check(writer, reads ? read : write);
  if (!may) {
    may.error().message +=
        fmt::format(" ([host] {} of this host says so)", reads ? "read_variables" : "write_variables");
  }
  return may;
}

}  // namespace plchost
