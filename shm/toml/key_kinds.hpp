#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/base/time.hpp"
#include "shm/toml/section_reader.hpp"

// The kinds of value that a key of a file can have. Each reads a key, says what it allows, and shows a
// default for the documentation.

namespace plchost {

struct TruthKey {
  template <class Reading>
  static void read(const Reading&, SectionReader& reader, std::string_view name, bool& target) {
    reader.truth(name, target);
  }
  static std::string allowed() { return "true, false"; }
  static std::string shown(bool value) { return value ? "true" : "false"; }
};

/// A whole number.
template <std::int64_t Lowest, std::int64_t Highest>
struct NumberKey {
  template <class Reading, class Number>
  static void read(const Reading&, SectionReader& reader, std::string_view name, Number& target) {
    std::int64_t number = target;
    reader.number(name, Lowest, Highest, number);
    target = static_cast<Number>(number);
  }
  static std::string allowed() { return fmt::format("{} to {}", Lowest, Highest); }
  static std::string shown(std::int64_t value) { return value < Lowest ? "" : fmt::format("{}", value); }
};

/// A time as a whole number of this unit.
template <class Unit, std::int64_t Lowest, std::int64_t Highest>
struct TimeKey {
  template <class Reading>
  static void read(const Reading&, SectionReader& reader, std::string_view name, Duration& target) {
    std::int64_t number = std::chrono::duration_cast<Unit>(target).count();
    reader.number(name, Lowest, Highest, number);
    target = Unit(number);
  }
  static std::string allowed() { return fmt::format("{} to {}", Lowest, Highest); }
  static std::string shown(Duration value) {
    return fmt::format("{}", std::chrono::duration_cast<Unit>(value).count());
  }
};

/// A text. Rule has `form()`, the allowed texts in words, and `wrong()`, the fault of a text; empty: none.
template <class Rule>
struct TextKey {
  template <class Reading>
  static void read(const Reading& reading, SectionReader& reader, std::string_view name,
                   std::string& target) {
    reader.text(name, target);
    if (reader.wrong(name)) return;
    if (const std::string wrong = Rule::wrong(reading, target); !wrong.empty()) reader.problem(name, wrong);
  }
  static std::string allowed() { return Rule::form(); }
  static std::string shown(const std::string& value) {
    return value.empty() ? "" : fmt::format("`{}`", value);
  }
};

/// A name that the section must give.
template <std::size_t Most>
struct RequiredNameKey {
  template <class Reading>
  static void read(const Reading&, SectionReader& reader, std::string_view name, std::string& target) {
    reader.text(name, target);
    if (!reader.has(name)) return reader.problem(name, "is missing");
    if (!reader.has_text(name)) return;
    if (const auto good = check_name("name", target, Most); !good) reader.problem(name, good.error().message);
  }
  static std::string allowed() { return fmt::format("up to {} letters, digits, _ - .", Most); }
  static std::string shown(const std::string&) { return "required"; }
};

/// Up to Most of them.
template <std::size_t Most, class Rule>
struct TextsKey {
  template <class Reading>
  static void read(const Reading& reading, SectionReader& reader, std::string_view name,
                   std::vector<std::string>& target) {
    reader.texts(name, Most, target);
    for (const std::string& text : target) {
      if (const std::string wrong = Rule::wrong(reading, text); !wrong.empty()) reader.problem(name, wrong);
    }
  }
  static std::string allowed() { return fmt::format("up to {}: {}", Most, Rule::form()); }
  static std::string shown(const std::vector<std::string>& value) {
    return fmt::format("{}", fmt::join(value, ", "));
  }
};

/// One of these words.
template <const auto& Words>
struct WordKey {
  template <class Reading>
  static void read(const Reading&, SectionReader& reader, std::string_view name, std::string& target) {
    reader.choice(name, Words, target);
  }
  /// The value is the number of its word.
  template <class Reading, class Enum>
    requires std::is_enum_v<Enum>
  static void read(const Reading&, SectionReader& reader, std::string_view name, Enum& target) {
    std::string word(Words[std::to_underlying(target)]);
    reader.choice(name, Words, word);
    target = static_cast<Enum>(std::ranges::find(Words, word) - std::begin(Words));
  }
  static std::string allowed() { return fmt::format("`{}`", fmt::join(Words, "`, `")); }
  static std::string shown(const std::string& value) {
    return value.empty() ? "" : fmt::format("`{}`", value);
  }
  template <class Enum>
    requires std::is_enum_v<Enum>
  static std::string shown(Enum value) {
    return fmt::format("`{}`", Words[std::to_underlying(value)]);
  }
};

// Rules of texts.

template <std::size_t Most>
struct NameRule {
  static std::string form() { return fmt::format("up to {} letters, digits, _ - .", Most); }
  template <class Reading>
  static std::string wrong(const Reading&, const std::string& name) {
    const auto good = check_name("name", name, Most);
    return good ? "" : good.error().message;
  }
};

}  // namespace plchost
