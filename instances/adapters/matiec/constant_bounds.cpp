#include "instances/adapters/matiec/constant_bounds.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <map>
#include <optional>
#include <ranges>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "instances/adapters/iec/tokens.hpp"

namespace plchost::matiec {

namespace {

/// By their folded names.
using Constants = std::map<std::string, std::int64_t>;

// "10", "-3", "1_000", "16#FF", "INT#5", or the name of another one.
std::optional<std::int64_t> number_in(std::string_view value, const Constants& known) {
  std::string text = iec::folded(value);
  std::erase(text, '_');
  const bool negative = text.starts_with('-');
  text.erase(0, negative ? 1 : 0);
  const std::size_t type = text.find('#');
  if (type != std::string::npos && type > 0 && text.front() >= 'A' && text.front() <= 'Z')
    text.erase(0, type + 1);
  int base = 10;
  for (const int other : {2, 8, 16}) {
    const std::string prefix = std::to_string(other) + "#";
    if (!text.starts_with(prefix)) continue;
    text.erase(0, prefix.size());
    base = other;
  }
  std::int64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, number, base);
  if (read.ec == std::errc() && read.ptr == end) return negative ? -number : number;
  const auto named = known.find(iec::folded(value));
  return named == known.end() ? std::nullopt : std::optional(named->second);
}

void add(const std::vector<iec::Variable>& variables, Constants& constants) {
  for (const iec::Variable& variable : variables) {
    if (!variable.constant || variable.section == iec::Variable::Section::external) continue;
    if (const auto number = number_in(variable.value, constants))
      constants.insert_or_assign(iec::folded(variable.name), *number);
  }
}

// A name before or behind "..".
std::string resolved(const std::string& type, const Constants& constants) {
  std::string made = type;
  const std::vector<iec::Token> tokens = iec::tokens_of(type, "").all;
  for (std::size_t i = tokens.size(); i-- > 0;) {
    const bool is_bound =
        (i > 0 && tokens[i - 1].is("..")) || (i + 1 < tokens.size() && tokens[i + 1].is(".."));
    if (!is_bound || tokens[i].kind != iec::Token::Kind::name) continue;
    const auto constant = constants.find(iec::folded(tokens[i].text));
    if (constant != constants.end())
      made.replace(tokens[i].offset, tokens[i].text.size(), std::to_string(constant->second));
  }
  return made;
}

void resolve(std::vector<iec::Variable>& variables, const Constants& constants) {
  for (iec::Variable& variable : variables) {
    if (variable.type.contains("..")) variable.type = resolved(variable.type, constants);
  }
}

/// Those that all configurations and resources agree about.
Constants globals_of(const iec::Project& project) {
  Constants all;
  std::vector<std::string> several;
  const auto take = [&](const Constants& some) {
    for (const auto& [name, number] : some) {
      if (all.try_emplace(name, number).first->second != number) several.push_back(name);
    }
  };
  for (const iec::Configuration& configuration : project.configurations) {
    Constants constants;
    add(configuration.globals, constants);
    take(constants);
    for (const iec::Resource& resource : configuration.resources) {
      Constants own = constants;
      add(resource.globals, own);
      take(own);
    }
  }
  for (const std::string& name : several) all.erase(name);
  return all;
}

}  // namespace

void resolve_bounds(iec::Project& project) {
  const Constants globals = globals_of(project);
  for (iec::Pou& pou : project.pous) {
    Constants known;
    for (const iec::Variable& variable : pou.variables) {
      if (variable.section != iec::Variable::Section::external) continue;
      if (const auto global = globals.find(iec::folded(variable.name)); global != globals.end())
        known.insert(*global);
    }
    add(pou.variables, known);
    resolve(pou.variables, known);
  }
  for (iec::Configuration& configuration : project.configurations) {
    resolve(configuration.globals, globals);
    for (iec::Resource& resource : configuration.resources) resolve(resource.globals, globals);
  }
}

}  // namespace plchost::matiec
