#pragma once

#include <string>
#include <string_view>

namespace plchost {

/// What is wrong with a line that the parser of TOML refuses, and what to write instead. `line`: the text of
/// the line; `parsers_words`: what the parser says of it, which is told if no usual mistake is found.
[[nodiscard]] std::string toml_advice(std::string_view line, std::string_view parsers_words);

}  // namespace plchost
