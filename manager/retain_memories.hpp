#pragma once

#include <string>
#include <vector>

#include "manager/config/manager_config.hpp"

namespace plchost {

/// Writes the retain variables that ended instances have left in memory to their files. These instances
/// crashed, are in back-off, failed or in safe mode, or their disk was full. A `plc-instance` does it for
/// each of them, all at the same time. To be called when all instances have ended; takes up to 20 s.
/// Returns the memories of the pool that hold values which are in no file: they must stay. Each is logged,
/// with the reason. Set-up.
[[nodiscard]] std::vector<std::string> save_retain_memories(const ManagerConfig& config,
                                                            const std::string& plc_instance);

}  // namespace plchost
