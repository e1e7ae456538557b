#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/task_plan.hpp"
#include "instances/adapters/strucpp/plan_file.hpp"

namespace plchost::strucpp {

/// A variable of an elementary type that others can see: see plc_variables.h.
struct Symbol {
  std::string name;    ///< as in the source, as far as it is known, with "[]" for each dimension
  unsigned type = 0;   ///< PLC_TYPE_...
  unsigned bytes = 0;  ///< of that type; 0: of a string
  std::string root;    ///< the object that it is in, in C++: "g_config", "strucpp::TOTAL"
  /// In C++, of a reference `c` to that object and the indexes i0, i1, i2: "plchost_at(c.ONE.GRID, i0, i1).X"
  std::string value;
  std::vector<PlannedSymbol::Bounds> bounds;
  std::string task;  ///< the only one that uses it; empty: several
  std::string area;  ///< "%QX0.1"; empty: none
  bool read_only = false;
};

struct Symbols {
  std::vector<Symbol> all;
  iec::SourceProblems remarks;  ///< variables that are left out, and why
};

/// PLC_TYPE_... of "INT"; 0: no type of this name, or a string.
[[nodiscard]] unsigned type_number(std::string_view name) noexcept;

/// Those of the programs of the plan, of the function blocks in them, and globals.
[[nodiscard]] Symbols symbols_of(const iec::Project& project, const iec::TaskPlan& plan,
                                 std::span<const PlannedSymbol> planned);

}  // namespace plchost::strucpp
