#pragma once

#include <span>
#include <vector>

#include "instances/adapters/iec/debug_pous.hpp"
#include "instances/adapters/iec/glue.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/matiec/located.hpp"

namespace plchost::matiec {

/// In C. `located`: of the whole configuration, from LOCATED_VARIABLES.h. `pous`: of a debug build.
[[nodiscard]] iec::Glue write_glue(const iec::Project& project, const iec::Configuration& configuration,
                                   const iec::Resource& resource, const std::vector<Located>& located,
                                   std::span<const iec::DebugPou> pous = {});

}  // namespace plchost::matiec
