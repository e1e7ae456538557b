#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "instances/adapters/iec/compiler.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/task_plan.hpp"

namespace plchost::iec {

/// A variable of a program, of a function block in it, or a global; not located.
struct ProgramVariable {
  std::string path;          ///< "MAIN.PUMP.HOURS", folded; of a global its name
  std::string value;         ///< in C or C++, for `&` and sizeof: "RES__MAIN.PUMP.HOURS.value"
  std::uint64_t layout = 0;  ///< another one if its type is another one
  bool retain = false;
};

struct ProgramVariables {
  std::vector<ProgramVariable> all;
  /// For each task of the plan the retained ones that it may change, as indexes.
  std::vector<std::vector<std::size_t>> retained;
  SourceProblems remarks;
};

/// An instance of a program, in the output of the compiler: "RES__MAIN".
[[nodiscard]] std::string instance_in_c(const Resource& resource, const Program& program, Compiler compiler);

/// Whether its values are plain memory: no function block, and nothing that has references.
[[nodiscard]] bool is_data(const Project& project, std::string_view type);

/// Those of which a value of the last cycle means something in the next one: no temporary ones, no constants.
[[nodiscard]] ProgramVariables variables_of(const Project& project, const Resource& resource,
                                            const TaskPlan& plan, Compiler compiler);

}  // namespace plchost::iec
