#include "instances/adapters/matiec/explained.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
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

/// The names that iec2c does not take for those of variables.
class WrongNames {
 public:
  WrongNames(const iec::Project& project, std::span<const iec::Source> sources) {
    for (const iec::Source& source : sources) {
      for (const Token& token : iec::tokens_of(source.text, source.file).all) {
        if (token.kind == Token::Kind::name)
          words_[{source.file, position(token.place)}] = iec::folded(token.text);
      }
    }
    for (const iec::Pou& pou : project.pous) declared_.insert(iec::folded(pou.name));
    for (const iec::DeclaredType& type : project.types) declared_.insert(iec::folded(type.name));
    for (const iec::Pou& pou : project.pous) add(pou.variables);
    for (const iec::Configuration& configuration : project.configurations) {
      add(configuration.globals);
      for (const iec::Resource& resource : configuration.resources) add(resource.globals);
    }
  }

  [[nodiscard]] iec::SourceProblem explained(iec::SourceProblem problem) const {
    // If it comes first in its section, iec2c has its error at the key word before it.
    const bool is_at_section = problem.text.starts_with("unexpected token after 'VAR");
    const iec::Variable* variable = nullptr;
    for (const iec::Variable* const one : variables_) {
      if (one->place.file != problem.place.file || position(one->place) < position(problem.place)) continue;
      if (variable == nullptr || position(one->place) < position(variable->place)) variable = one;
    }
    if (const auto use = words_.find({problem.place.file, position(problem.place)});
        use != words_.end() && problem.text.starts_with("Variable not declared")) {
      if (std::string why = why_unknown(use->second); !why.empty()) return {problem.place, std::move(why)};
    }
    if (variable == nullptr || (variable->place != problem.place && !is_at_section)) return problem;
    const std::string why = reason(iec::folded(variable->name));
    if (why.empty()) return problem;
    return {variable->place, fmt::format("'{}' is {}; choose another name", variable->name, why)};
  }

 private:
  static std::pair<unsigned, unsigned> position(const iec::SourcePlace& place) {
    return {place.line, place.column};
  }
  void add(const std::vector<iec::Variable>& variables) {
    for (const iec::Variable& variable : variables) variables_.push_back(&variable);
  }
  [[nodiscard]] std::string reason(const std::string& name) const {
    if (std::ranges::find(kReservedNames, name) != kReservedNames.end()) return "a word of the language";
    return declared_.contains(name) ? "also the name of a type or POU" : "";
  }

  // iec2c declares such variables, and knows them in no statement.
  [[nodiscard]] std::string why_unknown(const std::string& name) const {
    for (const iec::Variable* const one : variables_) {
      if (iec::folded(one->name) != name) continue;
      const std::string type = iec::folded(one->type);
      if (type.starts_with("STRING") && type.contains('['))
        return fmt::format(
            "'{}' is a STRING with a length, which iec2c knows in no statement; declare it "
            "STRING",
            one->name);
      if (type.ends_with("R_EDGE") || type.ends_with("F_EDGE"))
        return fmt::format(
            "'{}' is an input with an edge, which iec2c knows in no statement; use R_TRIG or "
            "F_TRIG",
            one->name);
    }
    return "";
  }

  std::set<std::string> declared_;  // types and POUs, folded
  std::map<std::pair<std::string, std::pair<unsigned, unsigned>>, std::string> words_;  // names, folded
  std::vector<const iec::Variable*> variables_;
};

}  // namespace

iec::SourceProblems explained(iec::SourceProblems problems, std::span<const iec::Source> sources,
                              const iec::Project& project) {
  const WrongNames names(project, sources);
  iec::SourceProblems all;
  for (const iec::Source& source : sources) find_third_edition(source, all);
  for (iec::SourceProblem& problem : problems) {
    problem = names.explained(std::move(problem));
    if (std::ranges::find(all, problem) == all.end()) all.push_back(std::move(problem));
  }
  return all;
}

}  // namespace plchost::matiec
