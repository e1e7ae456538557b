#pragma once

#include <span>
#include <string>

#include "instances/adapters/iec/glue.hpp"
#include "instances/adapters/iec/project.hpp"

namespace plchost::strucpp {

/// In C++. It includes `files`, which STruC++ has written: one file is compiled faster than many.
[[nodiscard]] iec::Glue write_glue(const iec::Project& project, const iec::Configuration& configuration,
                                   const iec::Resource& resource, std::span<const std::string> files);

}  // namespace plchost::strucpp
