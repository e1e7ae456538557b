#pragma once

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace plchost {

// The words of a debugger's commands.

/// The text up to the first space, and what follows it.
inline std::pair<std::string_view, std::string_view> first_word(std::string_view text) noexcept {
  const std::size_t space = text.find(' ');
  if (space == std::string_view::npos) return {text, {}};
  return {text.substr(0, space), text.substr(space + 1)};
}

/// How much of the text is a place that begins with a quotation mark: "a file.st":7. It ends at the first
/// blank behind the second mark. 0: there is none.
inline std::size_t quoted_size(std::string_view text) noexcept {
  const std::size_t second = text.starts_with('"') ? text.find('"', 1) : std::string_view::npos;
  if (second == std::string_view::npos) return 0;
  return std::min(text.find(' ', second), text.size());
}

/// A place as it is found: without the quotation marks at its begin.
inline std::string without_quotes(std::string_view place) {
  std::string text(place);
  if (quoted_size(place) != place.size() || place.empty()) return text;
  text.erase(text.find('"', 1), 1);
  return text.substr(1);
}

/// Nothing: the text is something else, or has more than the number.
template <class Number>
std::optional<Number> number_in(std::string_view text) noexcept {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

}  // namespace plchost
