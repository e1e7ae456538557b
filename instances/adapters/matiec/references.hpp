#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"

namespace plchost::matiec {

/// The types of variables whose values have references begin with iec::kReference from now on: REF_TO, and
/// arrays, structures and other types with such values in them.
void mark_references(iec::Project& project);

/// References to function blocks, where they are declared. iec2c ends at some of them without a place.
/// `in_library`: whether a POU of that name, folded, is in the library of iec2c.
[[nodiscard]] iec::SourceProblems references_to_blocks(
    const iec::Project& project, std::span<const iec::Source> sources,
    const std::function<bool(const std::string& name)>& in_library);

/// The C code of iec2c, in which each `reference^ := value` is an assignment. By itself it is no C.
[[nodiscard]] std::string with_reference_assignments(std::string_view code);

/// The first REF_TO in the sources; without a file: there is none.
[[nodiscard]] iec::SourcePlace first_reference(std::span<const iec::Source> sources);

}  // namespace plchost::matiec
