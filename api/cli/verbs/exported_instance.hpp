#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <control.h>

#include "api/dds/variable_page.hpp"
#include "instances/adapters/plcopen/write_project.hpp"

namespace plchost {

/// The tasks and variables of one instance, as PLCopen knows them. A host knows no programs. The variables
/// whose names begin with one word and a dot, and which one task uses alone, are those of a program of this
/// word. A task without such variables gets a program that has none.
[[nodiscard]] plcopen::ExportedInstance exported_instance(std::string_view name,
                                                          std::span<const plc_TaskStatus> tasks,
                                                          std::span<const ListedVariable> variables);

}  // namespace plchost
