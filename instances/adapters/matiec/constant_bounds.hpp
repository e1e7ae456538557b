#pragma once

#include "instances/adapters/iec/project.hpp"

namespace plchost::matiec {

/// Bounds of arrays that name a constant become its number: ARRAY[1..N] OF INT. The constant is one of the
/// same POU, or a global. Others stay as they are.
void resolve_bounds(iec::Project& project);

}  // namespace plchost::matiec
