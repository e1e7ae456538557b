#include "instances/adapters/matiec/initial_values.hpp"

#include <algorithm>
#include <cstddef>

namespace plchost::matiec {

namespace {

constexpr std::string_view kMark = "PLCHOST_ONCE ";

// "void MAIN_init__(MAIN *data__, BOOL retain) {", "void config_init__(void) {"
bool begins_initial_values(std::string_view line) {
  constexpr std::string_view kResult = "void ";
  if (!line.starts_with(kResult) || !line.ends_with('{')) return false;
  line = line.substr(kResult.size(), line.find('(') - kResult.size());
  return line.ends_with("_init__");
}

}  // namespace

std::string with_marked_initial_values(std::string_view code) {
  std::string made;
  while (!code.empty()) {
    const std::size_t end = std::min(code.find('\n'), code.size() - 1) + 1;
    const std::string_view line = code.substr(0, end);
    if (begins_initial_values(line.substr(0, line.find('\n')))) made += kMark;
    made += line;
    code.remove_prefix(end);
  }
  return made;
}

}  // namespace plchost::matiec
