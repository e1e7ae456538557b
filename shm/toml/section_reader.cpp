#include "shm/toml/section_reader.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost {

std::string suggestion(std::string_view unknown, std::span<const std::string_view> known) {
  // The edit distance costs the product of the lengths; nothing of ours is that long.
  constexpr std::size_t kLongest = 64;
  const auto near = unknown.size() > kLongest ? std::string_view() : nearest_name(unknown, known);
  return near.empty() ? std::string() : fmt::format("; did you mean '{}'?", near);
}

const TomlValue* SectionReader::find(std::string_view key) {
  known_.push_back(key);
  const auto found = table_.find(key);
  return found == table_.end() ? nullptr : &found->second;
}

bool SectionReader::has_text(std::string_view key) const {
  const auto found = table_.find(key);
  return found != table_.end() && std::holds_alternative<std::string>(found->second.value);
}

unsigned SectionReader::line_of(std::string_view key) const {
  const auto found = table_.find(key);
  return found == table_.end() ? line_ : found->second.line;
}

void SectionReader::problem(std::string_view key, std::string_view text) {
  wrong_.emplace_back(key);
  const auto found = table_.find(key);
  problems_.push_back({.line = line_of(key),
                       .text = fmt::format("{} {}: {}", where_, key, text),
                       .column = found == table_.end() ? 0 : column_of(found->second)});
}

bool SectionReader::wrong(std::string_view key) const {
  return std::ranges::find(wrong_, key) != wrong_.end();
}

void SectionReader::wrong_type(std::string_view key, const TomlValue& value, std::string_view wanted) {
  const bool compound = value.value.index() == 0 || value.value.index() >= 5;
  problem(key, compound ? fmt::format("is {}; allowed is {}", value.shown(), wanted)
                        : fmt::format("{} is {}; allowed is {}", value.shown(), value.type_name(), wanted));
}

void SectionReader::text(std::string_view key, std::string& target) {
  const TomlValue* value = find(key);
  if (value == nullptr) return;
  if (const auto* text = std::get_if<std::string>(&value->value)) {
    // A zero byte would end the text early in paths and arguments.
    if (text->find('\0') != std::string::npos) return problem(key, "contains a zero character");
    target = *text;
  } else {
    wrong_type(key, *value, "a text in quotes");
  }
}

void SectionReader::truth(std::string_view key, bool& target) {
  const TomlValue* value = find(key);
  if (value == nullptr) return;
  if (const auto* truth = std::get_if<bool>(&value->value)) {
    target = *truth;
  } else {
    wrong_type(key, *value, "true or false");
  }
}

void SectionReader::number(std::string_view key, std::int64_t least, std::int64_t most,
                           std::int64_t& target) {
  const TomlValue* value = find(key);
  if (value == nullptr) return;
  const auto* number = std::get_if<std::int64_t>(&value->value);
  if (number == nullptr) {
    wrong_type(key, *value, fmt::format("a whole number from {} to {}", least, most));
  } else if (*number < least || *number > most) {
    problem(key, fmt::format("{} is out of range; allowed is {} to {}", *number, least, most));
  } else {
    target = *number;
  }
}

void SectionReader::choice(std::string_view key, std::span<const std::string_view> allowed,
                           std::string& target) {
  const TomlValue* value = find(key);
  if (value == nullptr) return;
  const auto* text = std::get_if<std::string>(&value->value);
  if (text == nullptr) {
    wrong_type(key, *value, fmt::format("one of {}", join_names(allowed)));
  } else if (std::ranges::find(allowed, *text) == allowed.end()) {
    problem(key, fmt::format("{} is not known; allowed are {}{}", value->shown(), join_names(allowed),
                             suggestion(*text, allowed)));
  } else {
    target = *text;
  }
}

void SectionReader::texts(std::string_view key, std::size_t most, std::vector<std::string>& target) {
  const TomlValue* value = find(key);
  if (value == nullptr) return;
  const auto* array = std::get_if<TomlArray>(&value->value);
  if (array == nullptr) return wrong_type(key, *value, "an array of texts, like [\"a\", \"b\"]");
  if (array->size() > most) {
    return problem(key, fmt::format("has {} elements; allowed are up to {}", array->size(), most));
  }
  std::vector<std::string> texts;
  for (const TomlValue& element : *array) {
    const auto* text = std::get_if<std::string>(&element.value);
    if (text == nullptr || text->find('\0') != std::string::npos) {
      return wrong_type(key, element, "an array of texts, like [\"a\", \"b\"]");
    }
    texts.push_back(*text);
  }
  target = std::move(texts);
}

void SectionReader::numbers(std::string_view key, std::int64_t least, std::int64_t most,
                            std::optional<std::vector<int>>& target) {
  const TomlValue* value = find(key);
  if (value == nullptr) return;
  const std::string wanted = fmt::format("an array of whole numbers from {} to {}", least, most);
  const auto* array = std::get_if<TomlArray>(&value->value);
  if (array == nullptr) return wrong_type(key, *value, wanted);
  std::vector<int> numbers;
  for (const TomlValue& element : *array) {
    const auto* number = std::get_if<std::int64_t>(&element.value);
    if (number == nullptr) return wrong_type(key, element, wanted);
    if (*number < least || *number > most) {
      return problem(key, fmt::format("{} is out of range; allowed is {} to {}", *number, least, most));
    }
    numbers.push_back(static_cast<int>(*number));
  }
  target = std::move(numbers);
}

void SectionReader::refuse_unknown_keys() {
  for (const auto& [key, value] : table_) {
    if (std::ranges::find(known_, std::string_view(key)) != known_.end()) continue;
    constexpr std::size_t kShown = 80;
    problems_.push_back(
        {.line = value.line,
         .text = fmt::format("{} unknown key '{}'; allowed are {}{}", where_, key.substr(0, kShown),
                             join_names(known_), suggestion(key, known_)),
         .column = column_of(value)});
  }
}

}  // namespace plchost
