#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "instances/adapters/iec/compiler.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"
#include "instances/adapters/iec/task_plan.hpp"

namespace plchost::iec {

/// A global of which a program works on a copy.
struct CopiedGlobal {
  std::string name;  ///< folded
  const Variable* variable = nullptr;
  /// The VAR_EXTERNAL of the program and of the function blocks in it, in C or C++: "RES__MAIN.PUMP.LIMIT".
  /// Each is a pointer.
  std::vector<std::string> externals;
  std::size_t dimensions = 0;  ///< of an array
};

struct ProgramCopies {
  std::vector<CopiedGlobal> all;
  SourceProblems remarks;  ///< globals that the program uses, and cannot have a copy of
};

[[nodiscard]] ProgramCopies copies_of(const Project& project, const Resource& resource, const TaskPlan& plan,
                                      const Program& program, Compiler compiler);

}  // namespace plchost::iec
