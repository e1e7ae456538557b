#pragma once

#include <span>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"

namespace plchost::matiec {

/// Names of which iec2c makes C that no compiler takes: macros of the headers that its C includes.
[[nodiscard]] iec::SourceProblems refused_names(const iec::Project& project);

/// POUs without variables, enumerations without a name, and bodies that begin with a ';'. iec2c loses its way
/// in them, and tells errors of what follows.
[[nodiscard]] iec::SourceProblems refused_pous(const iec::Project& project,
                                               std::span<const iec::Source> sources);

/// Words at which iec2c ends without a place. Of each source the first one.
[[nodiscard]] iec::SourceProblems refused_words(std::span<const iec::Source> sources);

}  // namespace plchost::matiec
