#pragma once

#include <span>
#include <string>

#include "api/cli/words/syntax.hpp"

namespace plchost {

/// The hint for a command line that has a word that no command knows, or that ends before its last word:
/// one line, with the words that may stand there. Empty: its words are right, or an unknown option comes
/// before the mistake.
[[nodiscard]] std::string word_hint(const Syntax& plcctl, std::span<const std::string> words);

}  // namespace plchost
