#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <control.h>

#include "api/dds/variable_page.hpp"
#include "instances/adapters/plcopen/write_project.hpp"

namespace plchost {

/// The tasks, programs and variables of one instance, as PLCopen knows them. Programs are the variables that
/// is_program() means. An application in C or C++ may declare none. Then the variables whose names begin with
/// one word and a dot, and which one task uses alone, are those of a program of this word. A task without a
/// program gets one that has no variables.
[[nodiscard]] plcopen::ExportedInstance exported_instance(std::string_view name,
                                                          std::span<const plc_TaskStatus> tasks,
                                                          std::span<const ListedVariable> variables);

}  // namespace plchost
