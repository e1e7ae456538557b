#include "instances/adapters/matiec/temporaries.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <vector>

namespace plchost::matiec {

namespace {

constexpr std::string_view kInitEnd = "_init__(";
constexpr std::string_view kOfBody = "_body__(";
/// In a body. iec2c writes nothing behind it, as the variables are in VAR now.
constexpr std::string_view kInitialise = "  // Initialise TEMP variables\n";

/// Takes the first line off a text, with its end.
std::string_view take_line(std::string_view& text) {
  const std::string_view line = text.substr(0, std::min(text.find('\n'), text.size() - 1) + 1);
  text.remove_prefix(line.size());
  return line;
}

/// The POU of "void MAIN_init__(MAIN *data__, BOOL retain) {"; nothing: the line begins no such function.
const iec::Pou* pou_of(std::string_view line, std::string_view end_of_name, const iec::Project& project) {
  constexpr std::string_view kVoid = "void ";
  const std::size_t end = line.find(end_of_name);
  if (!line.starts_with(kVoid) || end == std::string_view::npos || !line.ends_with("{\n")) return nullptr;
  return project.pou(line.substr(kVoid.size(), end - kVoid.size()));
}

/// Whether a statement of an _init__() sets this variable.
bool sets(std::string_view statement, const std::string& name) {
  const auto has = [&](const char* before, const char* behind) {
    return statement.contains(before + name + behind);
  };
  return has("(data__->", ",") || has("(data__->", ".") || has("(data__->,", ",") || has("(&data__->", ",");
}

/// The statements of an _init__(), which has begun. The text ends behind it.
std::vector<std::string> statements_of(std::string_view& code) {
  std::vector<std::string> statements;
  bool in_block = false;
  while (!code.empty() && !code.starts_with('}')) {
    const std::string_view line = take_line(code);
    if (in_block) {
      statements.back() += line;
    } else {
      statements.emplace_back(line);
    }
    if (line.starts_with("  {")) in_block = true;
    if (line.starts_with("  }")) in_block = false;
  }
  return statements;
}

std::string values_of(const iec::Pou& pou, const std::vector<std::string>& statements) {
  constexpr std::string_view kRetain = ",retain)";
  std::string values;
  for (const iec::Variable& variable : pou.variables) {
    if (variable.section != iec::Variable::Section::temporary) continue;
    for (std::string statement : statements) {
      if (!sets(statement, iec::folded(variable.name))) continue;
      if (const std::size_t at = statement.rfind(kRetain); at != std::string::npos)
        statement.replace(at, kRetain.size(), ",0)");
      values += statement;
    }
  }
  return values;
}

}  // namespace

bool TemporarySections::begins_one(const iec::Token& token) {
  if (token.is("FUNCTION")) in_function_ = true;
  if (token.is("END_FUNCTION")) in_function_ = false;
  return !in_function_ && token.is("VAR_TEMP");
}

std::string with_temporary_values(std::string_view code, const iec::Project& project) {
  std::string made;
  std::map<const iec::Pou*, std::string> values;
  const iec::Pou* body = nullptr;
  while (!code.empty()) {
    const std::string_view line = take_line(code);
    made += line;
    if (const iec::Pou* const pou = pou_of(line, kInitEnd, project)) {
      const std::string_view before = code;
      values[pou] = values_of(*pou, statements_of(code));
      made += before.substr(0, before.size() - code.size());
    } else if (const iec::Pou* const begun = pou_of(line, kOfBody, project)) {
      body = begun;
    } else if (line == kInitialise && body != nullptr) {
      made += values[body];
      body = nullptr;
    }
  }
  return made;
}

}  // namespace plchost::matiec
