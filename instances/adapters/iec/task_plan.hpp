#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "instances/adapters/iec/compiler.hpp"
#include "instances/adapters/iec/locations.hpp"
#include "instances/adapters/iec/place.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"

namespace plchost::iec {

/// A task of plchost, from a TASK or from a program that has none.
struct PlannedTask {
  std::string name;
  int priority = 0;
  std::int64_t interval_ns = 0;          ///< 0: freewheeling, or `single`
  std::string single;                    ///< the variable of the edge; empty: none
  std::vector<const Program*> programs;  ///< in the order of the source
  std::set<Place> places;                ///< of the located variables that they use
  std::set<std::string> globals;         ///< that they use, folded
  SourcePlace place;
  TaskExtension extension = {};
};

struct TaskPlan {
  std::vector<PlannedTask> tasks;
  /// Those that all programs of the resource see, by their folded name; of one name that of the resource.
  std::map<std::string, const Variable*> globals;
  Locations locations;
  /// All located variables of the project, in the order of the source.
  std::map<Place, std::vector<const Variable*>> located;
  SourceProblems problems;
  SourceProblems remarks;
};

/// The problems name all that the compiler cannot translate, or would leave out.
[[nodiscard]] TaskPlan plan_tasks(const Project& project, const Configuration& configuration,
                                  const Resource& resource, Compiler compiler);

}  // namespace plchost::iec
