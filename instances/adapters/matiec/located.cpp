#include "instances/adapters/matiec/located.hpp"

#include <algorithm>
#include <ranges>

#include "instances/adapters/iec/tokens.hpp"

namespace plchost::matiec {

// __LOCATED_VAR(BOOL,__IX0_1,I,X,0,1). Before it iec2c may write the names of globals of the configuration
// that are not located.
std::vector<Located> located_variables(std::string_view file) {
  constexpr std::string_view kBegin = "__LOCATED_VAR(";
  std::vector<Located> result;
  for (const auto part : std::views::split(file, '\n')) {
    std::string_view line(part.begin(), part.end());
    const std::size_t begin = line.find(kBegin);
    const std::size_t end = line.find(')', std::min(begin, line.size()));
    if (begin == std::string_view::npos || end == std::string_view::npos) continue;
    line = line.substr(begin + kBegin.size(), end - begin - kBegin.size());
    std::vector<std::string> words;
    for (const auto word : std::views::split(line, ',')) words.emplace_back(word.begin(), word.end());
    if (words.size() < 5) continue;
    // iec2c writes an S where no size stands in the source: %I0.3.
    std::string location = "%" + words[2] + (words[3] == "S" ? "" : words[3]) + words[4];
    for (std::size_t i = 5; i < words.size(); ++i) location += "." + words[i];
    result.push_back({.type = iec::folded(words[0]), .name = words[1], .location = std::move(location)});
  }
  return result;
}

}  // namespace plchost::matiec
