#pragma once

#include <span>
#include <string>
#include <vector>

#include "api/cli/words/syntax.hpp"

namespace plchost {

/// The words of a command line with the noun that was left out: a verb that has one noun only may stand
/// without it, "start line1" for "start instance line1". A word that may be a mistyped noun is left as it is.
[[nodiscard]] std::vector<std::string> with_noun(const Syntax& plcctl, std::vector<std::string> words);

/// The words of a command line that are neither options of plcctl nor their values.
[[nodiscard]] std::vector<std::string> without_options(const Syntax& plcctl,
                                                       std::span<const std::string> words);

}  // namespace plchost
