#include "shm/toml/toml_advice.hpp"

#include <algorithm>
#include <array>
#include <cctype>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/base/trimmed.hpp"

namespace plchost {

namespace {

constexpr std::string_view kBlanks = " \t\r\n";

std::string_view trim(std::string_view text) {
  return trimmed(text, kBlanks);
}

std::string lower_case(std::string_view text) {
  std::string lowered(text);
  std::ranges::transform(lowered, lowered.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lowered;
}

bool is_digits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

// Of a value that does not begin with a quote or bracket: "eth0", "0660", "/run/cell1", "yes".
std::string advice_for_word(std::string_view key, std::string_view word) {
  constexpr std::array<std::string_view, 4> kYes = {"true", "yes", "on", "y"};
  constexpr std::array<std::string_view, 4> kNo = {"false", "no", "off", "n"};
  const std::string lowered = lower_case(word);
  if (std::ranges::find(kYes, lowered) != kYes.end()) {
    return fmt::format("'{}' is no value; write true or false in small letters: {} = true", shown(word), key);
  }
  if (std::ranges::find(kNo, lowered) != kNo.end()) {
    return fmt::format("'{}' is no value; write true or false in small letters: {} = false", shown(word),
                       key);
  }
  const std::string_view digits = word.substr(word.starts_with('-') || word.starts_with('+') ? 1 : 0);
  if (is_digits(digits) && digits.front() != '0') {
    return fmt::format("the number {} of {} does not fit into 64 bit", shown(word), key);
  }
  const bool zero_first = is_digits(word) && word.size() > 1 && word.front() == '0';
  if (zero_first) {
    return fmt::format(
        "the number {0} begins with 0; put a mode in quotes ({1} = \"{0}\"), or write the "
        "number without the 0",
        shown(word), key);
  }
  if (word.find_first_of("\"'") != std::string_view::npos) return "";
  return fmt::format("'{0}' is no value; put texts in quotes: {1} = \"{0}\"", shown(word), key);
}

std::string advice_for_quoted(std::string_view key, std::string_view value) {
  const std::size_t end = value.find('"', 1);
  if (end == std::string_view::npos) return fmt::format("the closing quote of {} is missing", key);
  const std::string_view text = value.substr(1, end - 1);
  if (text.contains('\\')) {
    return fmt::format("'\\' begins a special character; put the text in single quotes: {} = '{}'", key,
                       shown(text));
  }
  const std::string_view behind = trim(value.substr(end + 1));
  if (behind.empty() || behind.starts_with('#')) return "";
  return fmt::format("'{}' stands behind the value of {}; remove it or begin a new line", shown(behind), key);
}

std::string advice_for(std::string_view line) {
  if (line.starts_with('[')) {
    const bool closed = line.contains(']');
    return closed ? "" : fmt::format("the closing ] of '{}' is missing", shown(line));
  }
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos) {
    return fmt::format("'{}' has no '='; a line is KEY = VALUE or [SECTION]", shown(line));
  }
  const std::string key = shown(trim(line.substr(0, equals)));
  const std::string_view value = trim(line.substr(equals + 1));
  if (value.empty() || value.starts_with('#')) return fmt::format("the value of {} is missing", key);
  if (value.starts_with('"')) return advice_for_quoted(key, value);
  if (value.starts_with('[')) {
    return fmt::format(
        "the list of {} is damaged; separate its values by commas, put texts in quotes and "
        "close it with ]",
        key);
  }
  if (value.starts_with('\'') || value.starts_with('{')) return "";
  return advice_for_word(key, trim(value.substr(0, value.find('#'))));
}

}  // namespace

std::string toml_advice(std::string_view line, std::string_view parsers_words) {
  const bool twice = parsers_words.contains("cannot redefine");
  if (twice) {
    const std::string key = shown(trim(line.substr(0, line.find('='))));
    return fmt::format("{} is given twice; remove one of them", key);
  }
  if (parsers_words.contains("maximum nested value depth")) return "a list or table is nested too deep";
  if (std::string advice = advice_for(trim(line)); !advice.empty()) return advice;
  return printable(std::string(parsers_words));
}

}  // namespace plchost
