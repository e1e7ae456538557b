#pragma once

#include <string>
#include <vector>

#include "instances/adapters/iec/source_place.hpp"

namespace plchost::iec {

/// Each as it is told.
[[nodiscard]] inline std::vector<std::string> texts(const SourceProblems& problems) {
  std::vector<std::string> result;
  for (const SourceProblem& problem : problems) result.push_back(describe(problem));
  return result;
}

}  // namespace plchost::iec
