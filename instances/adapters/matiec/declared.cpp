#include "instances/adapters/matiec/declared.hpp"

#include <algorithm>
#include <cstddef>
#include <ranges>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "instances/adapters/iec/c_texts.hpp"
#include "instances/adapters/iec/tokens.hpp"

namespace plchost::matiec {

namespace {

/// The names in a line of C, in their order. Texts are none.
std::vector<std::string> names_in(std::string_view line) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < line.size() && line[i] != '"';) {
    const std::size_t begin = i;
    while (i < line.size() && iec::is_of_name(line[i])) ++i;
    if (i > begin) {
      names.emplace_back(line.substr(begin, i - begin));
    } else {
      ++i;
    }
  }
  return names;
}

/// The POU whose structure or function the lines are in.
class Scope {
 public:
  explicit Scope(const iec::Project& project) : project_(project) {}

  /// Each line up to the one that is looked for.
  void take(std::string_view line) {
    if (line.starts_with("} ") || line == "}") pou_ = nullptr;
    if (line.starts_with(kProgram) || line.starts_with(kBlock)) {
      pou_ = project_.pou(line.substr(line.find_last_of(' ') + 1));
    } else if (line.starts_with("void ") || line.starts_with("PLCHOST_ONCE void ")) {
      std::string_view name = line.substr(0, line.find('('));
      name.remove_prefix(name.find_last_of(' ') + 1);
      for (const std::string_view end : {"_init__", "_body__"}) {
        if (name.ends_with(end)) pou_ = project_.pou(name.substr(0, name.size() - end.size()));
      }
    } else if (is_function_next_ && line.contains('(')) {
      const std::string_view head = line.substr(0, line.find('('));
      pou_ = project_.pou(head.substr(head.find_last_of(' ') + 1));
    }
    is_function_next_ = line.starts_with("// FUNCTION") && !line.starts_with(kBlock);
  }
  [[nodiscard]] const iec::Pou* pou() const noexcept { return pou_; }

 private:
  // Before the structure of one.
  static constexpr std::string_view kProgram = "// PROGRAM ";
  static constexpr std::string_view kBlock = "// FUNCTION_BLOCK ";

  const iec::Project& project_;
  const iec::Pou* pou_ = nullptr;
  bool is_function_next_ = false;
};

/// Of the names in a line that declares one, the last is the variable's: those of its type come first.
std::optional<Declaration> variable_in(const std::vector<std::string>& names,
                                       const std::vector<iec::Variable>& variables) {
  const bool declares = !names.empty() && names.front().starts_with("__DECLARE");
  std::optional<Declaration> found;
  for (const std::string& name : names) {
    const auto variable = std::ranges::find(variables, iec::folded(name),
                                            [](const iec::Variable& one) { return iec::folded(one.name); });
    if (variable == variables.end()) continue;
    found = Declaration{fmt::format("variable '{}'", variable->name), variable->place};
    if (!declares) break;
  }
  return found;
}

std::optional<Declaration> global_in(const std::vector<std::string>& names, const iec::Project& project) {
  for (const iec::Configuration& configuration : project.configurations) {
    if (auto found = variable_in(names, configuration.globals)) return found;
    for (const iec::Resource& resource : configuration.resources) {
      if (auto found = variable_in(names, resource.globals)) return found;
    }
  }
  return std::nullopt;
}

std::optional<Declaration> type_in(const std::vector<std::string>& names, const iec::Project& project) {
  for (const std::string& name : names) {
    const auto type = std::ranges::find(project.types, iec::folded(name),
                                        [](const iec::DeclaredType& one) { return iec::folded(one.name); });
    if (type != project.types.end()) return Declaration{fmt::format("type '{}'", type->name), type->place};
  }
  return std::nullopt;
}

}  // namespace

std::optional<Declaration> declared_in(std::string_view code, unsigned line, const iec::Project& project) {
  Scope scope(project);
  std::vector<std::string> names;
  unsigned number = 0;
  for (const auto part : std::views::split(code, '\n') | std::views::take(line)) {
    const std::string_view text(part.begin(), part.end());
    scope.take(text);
    if (++number == line) names = names_in(text);
  }
  if (names.empty()) return std::nullopt;
  const iec::Pou* const pou = scope.pou();
  if (pou != nullptr) {
    if (auto found = variable_in(names, pou->variables)) return found;
  } else if (auto found = global_in(names, project)) {
    return found;
  }
  if (auto found = type_in(names, project)) return found;
  if (pou == nullptr) return std::nullopt;
  return Declaration{fmt::format("'{}'", pou->name), pou->name_place};
}

}  // namespace plchost::matiec
