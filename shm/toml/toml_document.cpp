#include "shm/toml/toml_document.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "shm/toml/toml_advice.hpp"

namespace plchost {

namespace {

TomlValue convert(const toml::node& node);

TomlTable convert_table(const toml::table& table) {
  TomlTable converted;
  for (const auto& [key, node] : table) {
    TomlValue value = convert(node);
    // A header like [host] may span lines; the key's own line is what an editor shows.
    if (const auto begin = key.source().begin) {
      value.line = begin.line;
      value.column = begin.column;
    }
    converted.emplace(std::string(key.str()), std::move(value));
  }
  return converted;
}

TomlValue convert(const toml::node& node) {
  TomlValue converted;
  converted.line = node.source().begin.line;
  converted.column = node.source().begin.column;
  if (const auto* text = node.as_string()) {
    converted.value = text->get();
  } else if (const auto* number = node.as_integer()) {
    converted.value = number->get();
  } else if (const auto* real = node.as_floating_point()) {
    converted.value = real->get();
  } else if (const auto* boolean = node.as_boolean()) {
    converted.value = boolean->get();
  } else if (const auto* array = node.as_array()) {
    TomlArray values;
    for (const auto& element : *array) values.push_back(convert(element));
    converted.value = std::move(values);
  } else if (const auto* table = node.as_table()) {
    converted.value = convert_table(*table);
  }
  return converted;
}

// Lines are counted from 1; nothing: there is no such line.
std::string_view line_of(std::string_view text, unsigned line) {
  for (; line > 1; --line) {
    const std::size_t end = text.find('\n');
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return text.substr(0, text.find('\n'));
}

/// Looks for keys of so many parts that reading them would take more stack than there is: "a.a.a..." makes a
/// table within a table for each.
class KeyDepth {
 public:
  static constexpr unsigned kMostParts = 32;

  /// The line of the first one that is too deep; nothing: there is none.
  static std::optional<unsigned> first_too_deep(std::string_view text) {
    KeyDepth depth;
    while (!text.empty()) {
      if (depth.parts_ > kMostParts) return depth.line_;
      text.remove_prefix(depth.take(text));
    }
    return depth.parts_ > kMostParts ? std::optional(depth.line_) : std::nullopt;
  }

 private:
  // How many characters it has taken.
  std::size_t take(std::string_view text) {
    const char letter = text.front();
    if (letter == '"' || letter == '\'') return take_quoted(text, letter);
    if (letter == '#') return std::min(text.find('\n'), text.size());
    if (letter == '\n') ++line_;
    if (letter == '.') ++parts_;
    if (std::string_view("\n=,{}").contains(letter)) parts_ = 1;
    return 1;
  }
  std::size_t take_quoted(std::string_view text, char quote) {
    const std::string three(3, quote);
    const bool is_long = text.starts_with(three);
    const std::string_view end = is_long ? std::string_view(three) : std::string_view(three).substr(0, 1);
    std::size_t at = end.size();
    while (at < text.size() && !text.substr(at).starts_with(end)) {
      if (text[at] == '\n' && !is_long) return at;  // its fault is told by the parser
      if (text[at] == '\n') ++line_;
      at += quote == '"' && text[at] == '\\' ? 2U : 1U;
    }
    return std::min(at + end.size(), text.size());
  }

  unsigned line_ = 1;
  unsigned parts_ = 1;  // of the key that is being read
};

}  // namespace

std::string describe(const std::string& file, const ConfigProblem& problem) {
  if (problem.line == 0) return fmt::format("{}: {}", file, problem.text);
  if (problem.column == 0) return fmt::format("{}:{}: {}", file, problem.line, problem.text);
  return fmt::format("{}:{}:{}: {}", file, problem.line, problem.column, problem.text);
}

std::string_view TomlValue::type_name() const noexcept {
  constexpr std::array<std::string_view, 7> kNames = {
      "a date or time", "a text", "a whole number", "a fraction", "a truth value", "an array", "a table"};
  return kNames[value.index()];  // NOLINT: as many names as alternatives
}

std::string TomlValue::shown() const {
  constexpr std::size_t kShown = 80;
  if (const auto* text = std::get_if<std::string>(&value))
    return fmt::format("\"{}\"", text->substr(0, kShown));
  if (const auto* number = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *number);
  if (const auto* real = std::get_if<double>(&value)) {
    const std::string number = fmt::format("{}", *real);
    return number.find_first_not_of("-0123456789") == std::string::npos ? number + ".0" : number;
  }
  if (const auto* boolean = std::get_if<bool>(&value)) return *boolean ? "true" : "false";
  return std::string(type_name());
}

std::expected<TomlTable, ConfigProblem> parse_toml(std::string_view text) {
  if (const auto line = KeyDepth::first_too_deep(text)) {
    return std::unexpected(
        ConfigProblem{.line = *line,
                      .text = fmt::format("a key has more than {} parts; no key of plchost has that many",
                                          KeyDepth::kMostParts),
                      .column = 0});
  }
  try {
    return convert_table(toml::parse(text));
  } catch (const toml::parse_error& error) {  // the library is built to say it so
    const auto at = error.source().begin;
    return std::unexpected(ConfigProblem{.line = at.line,
                                         .text = toml_advice(line_of(text, at.line), error.description()),
                                         .column = at.column});
  }
}

}  // namespace plchost
