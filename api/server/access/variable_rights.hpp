#pragma once

#include "api/dds/guid.hpp"
#include "api/security/role.hpp"
#include "api/server/clients/access_guard.hpp"
#include "shm/base/result.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

/// Which roles may use the variables of a secured host's instances: [host] read_variables, write_variables.
struct VariableRights {
  security::Role read = security::Role::engineer;
  security::Role write = security::Role::engineer;  ///< also to force

  /// refused: the writer's identity has not that right; the text names the key.
  [[nodiscard]] Result<void> check(OperationRight right, const AccessGuard& guard,
                                   const dds::Guid& writer) const;
};

}  // namespace plchost
