#pragma once

#include <string>
#include <vector>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"
#include "instances/adapters/matiec/located.hpp"

namespace plchost::matiec {

/// The C file that joins what iec2c has written for one resource with application.c.
struct Glue {
  std::string text;
  iec::SourceProblems problems;  ///< the application cannot be built
  iec::SourceProblems remarks;   ///< it can, and does something that its author may not expect
};

/// `located`: of the whole configuration, from LOCATED_VARIABLES.h.
[[nodiscard]] Glue write_glue(const iec::Project& project, const iec::Configuration& configuration,
                              const iec::Resource& resource, const std::vector<Located>& located);

}  // namespace plchost::matiec
