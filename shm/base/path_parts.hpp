#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace plchost {

/// How many parts two paths have in common at their ends: 2 for "a/line/main.st" and "/b/line/main.st".
[[nodiscard]] constexpr std::size_t common_last_parts(std::string_view left,
                                                      std::string_view right) noexcept {
  std::size_t count = 0;
  for (;;) {
    const std::size_t left_slash = left.find_last_of('/');
    const std::size_t right_slash = right.find_last_of('/');
    if (left.substr(left_slash + 1) != right.substr(right_slash + 1)) return count;
    ++count;
    if (left_slash == std::string_view::npos || right_slash == std::string_view::npos) return count;
    left = left.substr(0, left_slash);
    right = right.substr(0, right_slash);
  }
}

[[nodiscard]] constexpr std::size_t path_parts(std::string_view path) noexcept {
  return static_cast<std::size_t>(std::ranges::count(path, '/')) + 1;
}

}  // namespace plchost
