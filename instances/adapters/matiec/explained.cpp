#include "instances/adapters/matiec/explained.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"

namespace plchost::matiec {

namespace {

using iec::Token;

// Of those of the language, the ones that programs have as names of variables.
constexpr std::array<std::string_view, 30> kReservedNames{
    "ACTION", "ANY",      "AT",      "BY",     "CONFIGURATION", "CONSTANT", "DATE",   "DO",
    "DT",     "EN",       "ENO",     "F_EDGE", "FROM",          "INTERVAL", "MOD",    "OF",
    "ON",     "PRIORITY", "PROGRAM", "R_EDGE", "READ_ONLY",     "RESOURCE", "SINGLE", "STEP",
    "TASK",   "TIME",     "TO",      "TOD",    "TRANSITION",    "WITH"};

/// A declaration of the third edition. Its end tells it from a variable of that name.
struct NewDeclaration {
  std::string_view word;
  std::string_view end;
};
constexpr std::array<NewDeclaration, 3> kNewDeclarations{
    {{"INTERFACE", "END_INTERFACE"}, {"METHOD", "END_METHOD"}, {"PROPERTY", "END_PROPERTY"}}};
// Behind FUNCTION_BLOCK, or behind its name.
constexpr std::array<std::string_view, 4> kOfBlocks{"ABSTRACT", "FINAL", "EXTENDS", "IMPLEMENTS"};

bool is_any(const Token& token, const auto& words) {
  return std::ranges::any_of(words, [&](std::string_view word) { return token.is(word); });
}

iec::SourceProblem of_third_edition(const Token& token) {
  return {token.place,
          fmt::format("{}: MATIEC knows the second edition of IEC 61131-3 only; STruC++ knows this word",
                      iec::folded(token.text))};
}

void find_third_edition(const iec::Source& source, iec::SourceProblems& problems) {
  const std::vector<Token> tokens = iec::tokens_of(source.text, source.file).all;
  for (const NewDeclaration& part : kNewDeclarations) {
    const auto named = std::ranges::find_if(tokens, [&](const Token& token) { return token.is(part.word); });
    const bool has_end =
        std::any_of(named, tokens.end(), [&](const Token& token) { return token.is(part.end); });
    if (has_end) problems.push_back(of_third_edition(*named));
  }
  for (std::size_t i = 1; i < tokens.size(); ++i) {
    const bool is_of_block =
        tokens[i - 1].is("FUNCTION_BLOCK") || (i > 1 && tokens[i - 2].is("FUNCTION_BLOCK"));
    if (!is_of_block || !is_any(tokens[i], kOfBlocks)) continue;
    problems.push_back(of_third_edition(tokens[i]));
    break;
  }
  for (std::size_t i = 1; i < tokens.size(); ++i) {
    if (!tokens[i - 1].is("STRING") || tokens[i].text != "(") continue;
    problems.push_back({tokens[i - 1].place, "STRING(n): MATIEC wants the length in brackets, STRING[n]"});
    break;
  }
}

}  // namespace

iec::SourceProblems explained(iec::SourceProblems problems, std::span<const iec::Source> sources,
                              const iec::Project& project) {
  std::set<std::string> declared;
  for (const iec::Pou& pou : project.pous) declared.insert(iec::folded(pou.name));
  for (const iec::DeclaredType& type : project.types) declared.insert(iec::folded(type.name));
  const auto explain = [&](const std::vector<iec::Variable>& variables) {
    for (const iec::Variable& variable : variables) {
      const std::string name = iec::folded(variable.name);
      const bool is_word = std::ranges::find(kReservedNames, name) != kReservedNames.end();
      if (!is_word && !declared.contains(name)) continue;
      for (iec::SourceProblem& problem : problems) {
        if (problem.place != variable.place) continue;
        problem.text = fmt::format("'{}' is {}; choose another name", variable.name,
                                   is_word ? "a word of the language" : "also the name of a type or POU");
      }
    }
  };
  for (const iec::Pou& pou : project.pous) explain(pou.variables);
  for (const iec::Configuration& configuration : project.configurations) {
    explain(configuration.globals);
    for (const iec::Resource& resource : configuration.resources) explain(resource.globals);
  }
  iec::SourceProblems all;
  for (const iec::Source& source : sources) find_third_edition(source, all);
  all.insert(all.end(), problems.begin(), problems.end());
  return all;
}

}  // namespace plchost::matiec
