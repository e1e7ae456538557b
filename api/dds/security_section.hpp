#pragma once

#include <string>

#include "shm/base/result.hpp"

namespace plchost::dds {

/// The part of Cyclone's configuration that loads the plugins of DDS Security and shows the identity in that
/// folder. Empty for no folder. invalid_argument: a path that Cyclone would not take as it is.
[[nodiscard]] Result<std::string> security_section(const std::string& folder);

}  // namespace plchost::dds
