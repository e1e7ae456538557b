#include "instances/adapters/matiec/uses.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/pragmas.hpp"
#include "instances/adapters/iec/tokens.hpp"

namespace plchost::matiec {

namespace {

using iec::Token;

/// The words of a POU, or those between POUs.
struct Part {
  std::string kind;  ///< "FUNCTION_BLOCK"; empty: between POUs
  std::string name;
  iec::SourcePlace place;
  std::set<std::string> words;  ///< its names, folded, also those of its C
  std::vector<std::pair<std::size_t, iec::Stretch>>
      pragmas{};  ///< with C; the number of the source comes first
};

bool has_code(const Token& token) {
  if (token.kind != Token::Kind::pragma || iec::is_of_other_tools(token)) return false;
  // iec2c itself reads these.
  return token.text != "{disable code generation}" && token.text != "{enable code generation}";
}

/// The names in C of which iec2c makes those of POUs: F, F_body__, F_init__.
void add_words_of_code(const Token& pragma, std::set<std::string>& words) {
  constexpr std::array<std::string_view, 2> kEndings{"_BODY__", "_INIT__"};
  const std::size_t braces = pragma.text.starts_with("{{") ? 2 : 1;
  const std::string_view code = std::string_view(pragma.text).substr(braces);
  for (const Token& token : iec::tokens_of(code, "").all) {
    if (token.kind != Token::Kind::name) continue;
    std::string word = iec::folded(token.text);
    for (const std::string_view ending : kEndings) {
      if (word.ends_with(ending)) word.resize(word.size() - ending.size());
    }
    words.insert(std::move(word));
  }
}

/// Each POU, and one more for what is between them.
class PartReader {
 public:
  void read(std::size_t number, const iec::Source& source) {
    in_configuration_ = false;
    end_.clear();
    const iec::Tokens tokens = iec::tokens_of(source.text, source.file);
    for (std::size_t i = 0; i + 1 < tokens.all.size(); ++i) {
      const Token& token = tokens.all[i];
      if (token.is("CONFIGURATION")) in_configuration_ = true;
      if (token.is("END_CONFIGURATION")) in_configuration_ = false;
      if (end_.empty() && begins_pou(token) && tokens.all[i + 1].kind == Token::Kind::name) {
        const std::string kind = iec::folded(token.text);
        end_ = "END_" + kind;
        parts_.push_back(
            {.kind = kind, .name = tokens.all[i + 1].text, .place = tokens.all[i + 1].place, .words = {}});
      }
      take(number, token, end_.empty() ? parts_.front() : parts_.back());
      if (token.is(end_)) end_.clear();
    }
  }
  [[nodiscard]] const std::vector<Part>& parts() const noexcept { return parts_; }

 private:
  [[nodiscard]] bool begins_pou(const Token& token) const noexcept {
    // Also an instance of a program begins with PROGRAM.
    return !in_configuration_ && (token.is("PROGRAM") || token.is("FUNCTION_BLOCK") || token.is("FUNCTION"));
  }
  static void take(std::size_t number, const Token& token, Part& part) {
    if (token.kind == Token::Kind::name) part.words.insert(iec::folded(token.text));
    if (!has_code(token)) return;
    add_words_of_code(token, part.words);
    part.pragmas.push_back({number, {token.offset, token.text.size()}});
  }

  std::vector<Part> parts_{Part{}};
  bool in_configuration_ = false;
  std::string end_;  // of the POU; empty: between POUs
};

/// Those that a program of the CONFIGURATION reaches, by their folded name. A variable that has the name of a
/// POU counts as a use.
std::set<std::string> reached(const std::vector<Part>& parts) {
  std::map<std::string, const Part*> pous;
  for (const Part& part : parts) {
    if (!part.kind.empty()) pous.try_emplace(iec::folded(part.name), &part);
  }
  std::set<std::string> names;
  std::vector<const Part*> open{&parts.front()};
  while (!open.empty()) {
    const Part* const part = open.back();
    open.pop_back();
    for (const std::string& word : part->words) {
      const auto pou = pous.find(word);
      if (pou != pous.end() && names.insert(word).second) open.push_back(pou->second);
    }
  }
  return names;
}

// The braces stay: the pragma may be the only statement of an IF.
void blank_code(std::string& text, const iec::Stretch& pragma) {
  const std::size_t braces = std::string_view(text).substr(pragma.offset).starts_with("{{") ? 2 : 1;
  if (pragma.bytes < 2 * braces) return;
  for (char& c : std::span(text).subspan(pragma.offset + braces, pragma.bytes - 2 * braces)) {
    if (c != '\n' && c != '\r') c = ' ';
  }
}

/// The names of POUs and types that the sources declare.
class Declarations {
 public:
  explicit Declarations(std::span<const iec::Source> sources) {
    const iec::Project project = iec::read_project(sources).project;
    for (const iec::Pou& pou : project.pous) places_.try_emplace(iec::folded(pou.name), pou.name_place);
    for (const iec::DeclaredType& type : project.types)
      places_.try_emplace(iec::folded(type.name), type.place);
  }
  /// Each token, in the order of the sources: whether it names one whose declaration follows.
  [[nodiscard]] bool is_early(const Token& token) {
    if (token.kind != Token::Kind::name) return false;
    const auto found = places_.find(iec::folded(token.text));
    if (found == places_.end()) return false;
    if (found->second != token.place) return true;
    places_.erase(found);
    return false;
  }

 private:
  std::map<std::string, iec::SourcePlace> places_;  // of those that follow
};

}  // namespace

iec::SourceProblems blank_unused_pragmas(std::vector<iec::Source>& sources) {
  PartReader reader;
  for (std::size_t i = 0; i < sources.size(); ++i) reader.read(i, sources[i]);
  const std::set<std::string> used = reached(reader.parts());
  iec::SourceProblems remarks;
  for (const Part& part : reader.parts()) {
    if (part.kind.empty() || part.pragmas.empty() || used.contains(iec::folded(part.name))) continue;
    for (const auto& [source, pragma] : part.pragmas) blank_code(sources[source].text, pragma);
    remarks.push_back(
        {part.place, fmt::format("{} {} is not used by a program of the CONFIGURATION: the C in "
                                 "its pragmas is left out",
                                 part.kind, part.name)});
  }
  return remarks;
}

bool declares_before_use(std::span<const iec::Source> sources) {
  Declarations declarations(sources);
  return std::ranges::all_of(sources, [&](const iec::Source& source) {
    const iec::Tokens tokens = iec::tokens_of(source.text, source.file);
    return std::ranges::none_of(tokens.all, [&](const Token& token) { return declarations.is_early(token); });
  });
}

}  // namespace plchost::matiec
