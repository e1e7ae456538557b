#pragma once

#include <string>

#include "api/cli/words/syntax.hpp"

namespace plchost {

/// The manual page in section 1, as man(1) reads it. `exit_codes`: a line of text.
[[nodiscard]] std::string man_page(const Syntax& program, const std::string& exit_codes);

}  // namespace plchost
