#include "instances/adapters/matiec/unknown_values.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "instances/adapters/iec/tokens.hpp"

namespace plchost::matiec {

namespace {

using iec::Token;
using Sequence = std::vector<Token>;

bool has_value(const std::vector<std::string>& values, const std::string& value) {
  return std::ranges::find(values, value) != values.end();
}

/// The types of the sources, by their folded names.
class Types {
 public:
  explicit Types(const iec::Project& project) {
    for (const iec::DeclaredType& type : project.types)
      definitions_[iec::folded(type.name)] = iec::tokens_of(type.definition, type.place.file).all;
  }

  /// Of "ALIAS : MODE", also over several; else the name itself. Folded.
  [[nodiscard]] std::string resolved(std::string_view name) const {
    std::string type = iec::folded(name);
    for (std::size_t depth = 0; depth < iec::kMostNested; ++depth) {
      const Sequence* const words = definition(type);
      if (words == nullptr || words->size() < 3 || (*words)[2].kind != Token::Kind::name ||
          (*words)[2].is("STRUCT") || (*words)[2].is("ARRAY"))
        break;
      type = iec::folded((*words)[2].text);
    }
    return type;
  }
  /// The values of "MODE : ( IDLE , BUSY )"; empty: it is no enumeration.
  [[nodiscard]] std::vector<std::string> values(std::string_view name) const {
    const Sequence* const words = definition(resolved(name));
    if (words == nullptr || words->size() < 3 || !(*words)[2].is("(")) return {};
    std::vector<std::string> values;
    for (std::size_t i = 3; i < words->size() && !(*words)[i].is(")"); ++i) {
      if ((*words)[i].kind == Token::Kind::name) values.push_back(iec::folded((*words)[i].text));
    }
    return values;
  }
  /// Of a structure; empty: it is not known.
  [[nodiscard]] std::string type_of_field(std::string_view name, std::string_view field) const {
    const Sequence* const words = definition(resolved(name));
    if (words == nullptr) return {};
    for (std::size_t i = 3; i + 2 < words->size(); ++i) {
      if ((*words)[i].is(field) && (*words)[i + 1].is(":")) return type_at(*words, i + 2);
    }
    return {};
  }
  /// The type whose words begin there: of an array that of its elements. Empty: it is written out there.
  [[nodiscard]] std::string type_at(const Sequence& words, std::size_t begin) const {
    std::string type;
    for (std::size_t i = begin; i < words.size(); ++i) {
      const Token& word = words[i];
      if (word.is(":=") || word.is(";") || word.kind == Token::Kind::end) break;
      if (word.is("(") || word.is("STRUCT")) return {};
      if (word.kind == Token::Kind::name) type = word.text;
    }
    const Sequence* const array = definition(resolved(type));
    return array != nullptr && array->size() > 3 && (*array)[2].is("ARRAY") ? type_at(*array, 3) : type;
  }
  [[nodiscard]] bool is_value(std::string_view name) const {
    return std::ranges::any_of(
        definitions_, [&](const auto& type) { return has_value(values(type.first), iec::folded(name)); });
  }

 private:
  [[nodiscard]] const Sequence* definition(const std::string& folded_name) const {
    const auto found = definitions_.find(folded_name);
    return found == definitions_.end() ? nullptr : &found->second;
  }

  std::map<std::string, Sequence> definitions_;
};

class ValueScan {
 public:
  ValueScan(const Sequence& words, const Types& types) : words_(words), types_(types) {}

  iec::SourceProblems run() {
    bool declares = false;
    for (std::size_t i = 0; i < words_.size(); ++i) {
      const std::string word = iec::folded(words_[i].text);
      if (word.starts_with("VAR") || word == "TYPE") declares = true;
      if (word == "END_VAR" || word == "END_TYPE") declares = false;
      if (declares && words_[i].is(":")) look_at_declaration(i + 1);
    }
    return std::move(problems_);
  }

 private:
  void look_at_declaration(std::size_t begin) {
    const std::string type = types_.type_at(words_, begin);
    std::size_t i = begin;
    const auto at = [&](std::string_view word) { return i < words_.size() && words_[i].is(word); };
    while (i < words_.size() && !at(":=") && !at(";") && !at("END_VAR") && !at("END_TYPE")) ++i;
    if (type.empty() || !at(":=")) return;
    // A value by itself has its place in the errors of iec2c.
    if (++i; !at("(") && !at("[")) return;
    std::string expected = type;
    std::vector<std::string> structures;
    for (; i < words_.size() && !at(";") && !at("END_VAR") && !at("END_TYPE"); ++i) {
      if (at("(")) {
        structures.push_back(expected);
      } else if (at(")") && !structures.empty()) {
        expected = structures.back();
        structures.pop_back();
      } else if (i + 1 < words_.size() && words_[i + 1].is(":=")) {
        expected = structures.empty() ? "" : types_.type_of_field(structures.back(), words_[i].text);
      } else {
        look_at_value(words_[i], expected);
      }
    }
  }
  void look_at_value(const Token& word, const std::string& type) {
    const bool is_literal = word.kind == Token::Kind::literal;
    if ((word.kind != Token::Kind::name && !is_literal) || word.is("TRUE") || word.is("FALSE")) return;
    const std::vector<std::string> values = types_.values(type);
    if (is_literal && values.empty()) return;
    const std::string value = iec::folded(word.text.substr(word.text.find('#') + 1));
    if (!values.empty() && !has_value(values, value)) {
      problems_.push_back({word.place, fmt::format("'{}' is no value of {}; it has {}", word.text, type,
                                                   fmt::join(values, ", "))});
    } else if (values.empty() && !types_.is_value(word.text)) {
      problems_.push_back(
          {word.place,
           fmt::format("'{}' is no value of an enumeration; initial values are literals, or values "
                       "of an enumeration",
                       word.text)});
    }
  }

  const Sequence& words_;
  const Types& types_;
  iec::SourceProblems problems_;
};

}  // namespace

iec::SourceProblems unknown_values(std::span<const iec::Source> sources, const iec::Project& project) {
  const Types types(project);
  iec::SourceProblems problems;
  for (const iec::Source& source : sources) {
    const iec::Tokens tokens = iec::tokens_of(source.text, source.file);
    std::ranges::move(ValueScan(tokens.all, types).run(), std::back_inserter(problems));
  }
  return problems;
}

}  // namespace plchost::matiec
