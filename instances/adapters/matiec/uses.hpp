#pragma once

#include <span>
#include <vector>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"

namespace plchost::matiec {

/// Replaces the C in the pragmas of POUs that no program of the CONFIGURATION uses by blanks, so that no
/// other place moves. That C may need functions of another runtime, as the LOGGER of the editors of Beremiz
/// and OpenPLC does. Returns a remark for each such POU.
[[nodiscard]] iec::SourceProblems blank_unused_pragmas(std::vector<iec::Source>& sources);

/// Whether the sources, one behind the other, name each POU and each type only behind its declaration.
[[nodiscard]] bool declares_before_use(std::span<const iec::Source> sources);

}  // namespace plchost::matiec
