#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace plchost::dds {

/// Bounded texts of control.idl are char arrays in place: zero-filled, always terminated, cut if too long.
template <std::size_t N>
void copy_text(char (&to)[N], std::string_view from) noexcept {
  std::fill(std::begin(to), std::end(to), '\0');
  std::copy_n(from.begin(), std::min(from.size(), N - 1), std::begin(to));
}

/// Never reads past the end.
template <std::size_t N>
[[nodiscard]] std::string_view text_of(const char (&from)[N]) noexcept {
  const auto end = std::find(std::begin(from), std::end(from), '\0');
  return {std::begin(from), static_cast<std::size_t>(end - std::begin(from))};
}

}  // namespace plchost::dds
