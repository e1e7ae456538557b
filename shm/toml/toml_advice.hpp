#pragma once

#include <string>
#include <string_view>

namespace plchost {

/// The error in a line that the parser of TOML refuses, and the text to write instead. `line`: the text of
/// the line; `parsers_words`: the parser's error, which is told if no usual mistake is found.
[[nodiscard]] std::string toml_advice(std::string_view line, std::string_view parsers_words);

}  // namespace plchost
