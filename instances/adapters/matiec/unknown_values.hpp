#pragma once

#include <span>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"

namespace plchost::matiec {

/// Names in initial values of structures and arrays that are no value of the enumeration there, or of none.
/// iec2c ends at such a one without a place. A type that is written out in the declaration is not looked at.
[[nodiscard]] iec::SourceProblems unknown_values(std::span<const iec::Source> sources,
                                                 const iec::Project& project);

}  // namespace plchost::matiec
