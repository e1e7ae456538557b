#pragma once

#include <string>

#include "manager/config/load_config.hpp"

namespace plchost {

/// The surroundings of a configuration, as the system is now.
[[nodiscard]] ConfigSurroundings config_surroundings();
/// The same with all that a start needs. `programs`: the folder of plc-instance.
[[nodiscard]] ConfigSurroundings start_surroundings(const std::string& programs);

}  // namespace plchost
