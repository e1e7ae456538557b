#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "instances/adapters/iec/debug_pous.hpp"
#include "instances/adapters/iec/place.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/task_plan.hpp"

namespace plchost::matiec {

/// A variable of an elementary type that others can see: see plc_variables.h.
struct Symbol {
  struct Dimension {
    int first = 0;
    unsigned count = 0;
    std::string stride;  ///< of its elements, in C: "sizeof(RES__MAIN.GRID.value.table[0])"
  };
  std::string name;   ///< as in the source, with "[]" for each dimension
  unsigned type = 0;  ///< PLC_TYPE_...
  std::string value;  ///< in C, for `&` and sizeof: that of the first element
  std::vector<Dimension> dimensions;
  std::string task;  ///< the only one that uses it; empty: several
  std::string area;  ///< "%QX0.1"; empty: none
  bool read_only = false;
};

/// Where a located variable has its value, in C, for a program of task number `task`, or for all. Empty: it
/// has none.
using ValueOfPlace = std::function<std::string(const iec::Place& place, std::optional<std::size_t> task)>;

/// A program or function block with variables in it.
struct SymbolInstance {
  std::string path;   ///< that the names of its variables begin with: "MAIN.MOTOR"
  std::string value;  ///< in C, for `&`
  std::string type;   ///< name of its POU in upper case
};

struct Symbols {
  std::vector<Symbol> all;
  std::vector<SymbolInstance> instances;
  iec::SourceProblems remarks;  ///< variables that are left out, and why
};

/// Of all programs of the resource, the function blocks in them, and globals.
[[nodiscard]] Symbols symbols_of(const iec::Project& project, const iec::Resource& resource,
                                 const iec::TaskPlan& plan, const ValueOfPlace& value_of_place);

/// Its variables that are no symbols, in its C code: all of a function, and those of the sections VAR_IN_OUT
/// and VAR_TEMP of others. At most PLC_MAX_POU_LOCALS.
[[nodiscard]] std::vector<iec::DebugLocal> locals_of(const iec::Project& project, const iec::Pou& pou);

}  // namespace plchost::matiec
