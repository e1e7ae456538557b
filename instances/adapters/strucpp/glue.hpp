#pragma once

#include <span>
#include <string>

#include "instances/adapters/iec/debug_pous.hpp"
#include "instances/adapters/iec/glue.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/strucpp/plan_file.hpp"

namespace plchost::strucpp {

/// In C++. It includes `files`, which STruC++ has written: one file is compiled faster than many. `symbols`
/// can be seen from outside. `pous`: of a debug build.
[[nodiscard]] iec::Glue write_glue(const iec::Project& project, const iec::Configuration& configuration,
                                   const iec::Resource& resource, std::span<const std::string> files,
                                   std::span<const PlannedSymbol> symbols,
                                   std::span<const iec::DebugPou> pous = {});

}  // namespace plchost::strucpp
