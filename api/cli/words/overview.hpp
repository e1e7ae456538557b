#pragma once

#include <string>

#include "api/cli/words/syntax.hpp"

namespace plchost {

/// The words that may stand behind those of `level`, a line for each: its words, or the nouns of each verb
/// below the program itself. `said`: the words so far, "plcctl" or "plcctl list".
[[nodiscard]] std::string overview(const Syntax& level, const std::string& said);

}  // namespace plchost
