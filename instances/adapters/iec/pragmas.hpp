#pragma once

#include <span>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"
#include "instances/adapters/iec/tokens.hpp"

namespace plchost::iec {

/// Whether it is a pragma that editors and other compilers read: {attribute 'hide'}, {region 'inputs'}.
[[nodiscard]] bool is_of_other_tools(const Token& token);

/// Remarks on those that a program may rely on, as {error 'to do'}: each text once, with its first place.
[[nodiscard]] SourceProblems idle_pragmas(std::span<const Source> sources);

}  // namespace plchost::iec
