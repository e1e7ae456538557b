#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace plchost {

/// Each part of `text` that lies between `begin` and the next `end` after it. (Each file with a <regex> takes
/// seconds to compile.)
inline std::vector<std::string> texts_between(std::string_view text, std::string_view begin,
                                              std::string_view end) {
  std::vector<std::string> found;
  for (std::size_t from = 0; (from = text.find(begin, from)) != std::string_view::npos;) {
    from += begin.size();
    const std::size_t to = text.find(end, from);
    if (to == std::string_view::npos) break;
    found.emplace_back(text.substr(from, to - from));
    from = to + end.size();
  }
  return found;
}

}  // namespace plchost
