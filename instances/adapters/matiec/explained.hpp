#pragma once

#include <span>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"

namespace plchost::matiec {

/// The errors of a source that iec2c has refused, with reasons that it does not tell. These are words of the
/// third edition of IEC 61131-3, of each source the first one of a kind. A variable that is called as a word
/// of the language, a type or a POU is named where iec2c has an error.
[[nodiscard]] iec::SourceProblems explained(iec::SourceProblems problems,
                                            std::span<const iec::Source> sources,
                                            const iec::Project& project);

}  // namespace plchost::matiec
