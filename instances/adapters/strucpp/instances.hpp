#pragma once

#include <span>
#include <vector>

#include "instances/adapters/iec/debug_pous.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/task_plan.hpp"
#include "instances/adapters/strucpp/symbols.hpp"

namespace plchost::strucpp {

/// The programs of the plan and the function blocks in them that are of these POUs. Their paths are those of
/// the symbols. An instance without symbols is left out if others of its POU have some: a name of the POU is
/// a variable of each of its instances.
[[nodiscard]] std::vector<iec::DebugInstance> instances_of(const iec::Project& project,
                                                           const iec::TaskPlan& plan,
                                                           std::span<const Symbol> symbols,
                                                           std::span<const iec::DebugPou> pous);

}  // namespace plchost::strucpp
