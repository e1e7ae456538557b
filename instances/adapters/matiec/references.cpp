#include "instances/adapters/matiec/references.hpp"

#include <algorithm>
#include <cstddef>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "instances/adapters/iec/c_texts.hpp"
#include "instances/adapters/iec/tokens.hpp"

namespace plchost::matiec {

namespace {

constexpr std::string_view kRefTo = "REF_TO";

/// The types that have references in them.
class Referring {
 public:
  explicit Referring(const iec::Project& project) {
    std::vector<std::vector<iec::Token>> words;
    for (const iec::DeclaredType& type : project.types)
      words.push_back(iec::tokens_of(type.definition, type.place.file).all);
    for (bool found = true; found;) {
      found = false;
      for (std::size_t i = 0; i < words.size(); ++i) {
        // Its own name, at the begin, is none of its parts.
        if (has(std::span(words[i]).subspan(1)))
          found = names_.insert(iec::folded(project.types[i].name)).second || found;
      }
    }
  }
  [[nodiscard]] bool has(std::span<const iec::Token> words) const {
    return std::ranges::any_of(words, [&](const iec::Token& word) {
      return word.is(kRefTo) ||
             (word.kind == iec::Token::Kind::name && names_.contains(iec::folded(word.text)));
    });
  }

 private:
  std::set<std::string> names_;  // folded
};

}  // namespace

void mark_references(iec::Project& project) {
  const Referring referring(project);
  const auto mark = [&](std::vector<iec::Variable>& variables) {
    for (iec::Variable& variable : variables) {
      if (referring.has(iec::tokens_of(variable.type, "").all)) variable.type.insert(0, iec::kReference);
    }
  };
  for (iec::Pou& pou : project.pous) mark(pou.variables);
  for (iec::Configuration& configuration : project.configurations) {
    mark(configuration.globals);
    for (iec::Resource& resource : configuration.resources) mark(resource.globals);
  }
}

iec::SourceProblems references_to_blocks(const iec::Project& project, std::span<const iec::Source> sources,
                                         const std::function<bool(const std::string& name)>& in_library) {
  iec::SourceProblems problems;
  for (const iec::Source& source : sources) {
    const std::vector<iec::Token> tokens = iec::tokens_of(source.text, source.file).all;
    for (std::size_t i = 1; i < tokens.size(); ++i) {
      if (!tokens[i - 1].is(kRefTo)) continue;
      const std::string name = iec::folded(tokens[i].text);
      if (project.pou(name) == nullptr && !in_library(name)) continue;
      problems.push_back({tokens[i - 1].place,
                          fmt::format("REF_TO {}: iec2c cannot translate references to function blocks; use "
                                      "VAR_IN_OUT, or a reference to a structure",
                                      tokens[i].text)});
    }
  }
  return problems;
}

// __SET_VAR(data__->,(*LINK),(*.TARGET),VALUE) becomes
// PLCHOST_SET_REFERENCE(__GET_VAR(data__->LINK,.TARGET),VALUE)
std::string with_reference_assignments(std::string_view code) {
  constexpr std::string_view kSet = "__SET_";
  constexpr std::string_view kReference = ",(*";
  std::string made;
  for (std::size_t at = code.find(kSet); at != std::string_view::npos; at = code.find(kSet)) {
    made += code.substr(0, at);
    code.remove_prefix(at);
    const std::size_t open = code.find('(');
    const std::size_t comma = code.find(',');
    if (open < comma && comma != std::string_view::npos && code.substr(comma).starts_with(kReference)) {
      const std::string_view kind = code.substr(kSet.size(), open - kSet.size());
      const std::string_view prefix = code.substr(open + 1, comma - open - 1);
      const std::size_t name = comma + kReference.size();
      const std::size_t name_end = iec::find_outside(code, ")", name);
      const std::size_t suffix =
          name_end == std::string_view::npos ? name_end : name_end + 1 + kReference.size();
      if (suffix < code.size() && code.substr(name_end + 1).starts_with(kReference)) {
        const std::size_t end = iec::find_outside(code, ")", suffix);
        if (end != std::string_view::npos) {
          made += fmt::format("PLCHOST_SET_REFERENCE(__GET_{}({}{},{})", kind, prefix,
                              code.substr(name, name_end - name), code.substr(suffix, end - suffix));
          code.remove_prefix(end + 1);
          continue;
        }
      }
    }
    made += code.substr(0, kSet.size());
    code.remove_prefix(kSet.size());
  }
  made += code;
  return made;
}

iec::SourcePlace first_reference(std::span<const iec::Source> sources) {
  for (const iec::Source& source : sources) {
    const std::vector<iec::Token> tokens = iec::tokens_of(source.text, source.file).all;
    const auto found = std::ranges::find_if(tokens, [](const iec::Token& token) { return token.is(kRefTo); });
    if (found != tokens.end()) return found->place;
  }
  return {};
}

}  // namespace plchost::matiec
