#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"
#include "shm/base/result.hpp"

namespace plchost::strucpp {

/// A variable of the compiler's table for debuggers, or one that it leaves out; an array is one of them.
struct PlannedSymbol {
  struct Bounds {
    int first = 0;
    int last = 0;
  };
  std::string name;            ///< "ONE.GRID[][].X", "TOTAL"
  std::string type;            ///< "REAL"
  std::string value;           ///< in C++: "g_config.ONE.GRID[][].X", "TOTAL.value"
  std::vector<Bounds> bounds;  ///< for each []
  std::string hidden = {};     ///< why it is not in the table, and has a name only; empty: it is
};

/// A program as translate.mjs has read it.
struct ReadPlan {
  iec::Project project;
  std::vector<std::string> files;  ///< of C++, that STruC++ has written
  std::vector<PlannedSymbol> symbols;
  iec::SourceProblems problems;  ///< errors of the compiler, and those of tasks
  iec::SourceProblems remarks;
};

/// Reads plan.json. `sources`: the names of the files, by their number in it. Any text, hostile ones
/// included: an error names the value that is wrong, and what is allowed. Texts that go into C++ have only
/// letters that can do no harm there.
[[nodiscard]] Result<ReadPlan> read_plan(std::string_view text, std::span<const std::string> sources);

}  // namespace plchost::strucpp
