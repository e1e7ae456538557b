#include "instances/adapters/strucpp/instances.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"
#include "instances/plc_debug.h"
#include "instances/plc_variables.h"

namespace plchost::strucpp {

namespace {

using iec::folded;

// An element of an array of function blocks is the variable "PUMPS.0.1" with the member "PUMPS(0, 1)"; its
// variables are seen as PUMPS[0][1].X.
std::string name_in_path(const iec::Variable& variable) {
  std::string name = variable.name.substr(0, variable.name.find('.'));
  const std::size_t index = variable.member.find_first_of("[(");
  if (index == std::string::npos) return name;
  for (const char c : variable.member.substr(index)) {
    if (c == ',') name += "][";
    if (c == '(' || c == '[') name += '[';
    if (c == ')' || c == ']') name += ']';
    if (c == '-' || (c >= '0' && c <= '9')) name += c;
  }
  return name;
}

// MAIN.GRID[][].PUMP of Main.grid[0][1].pump
std::string pattern_of(std::string_view path) {
  std::string pattern;
  bool in_index = false;
  for (const char c : path) {
    if (c == ']') in_index = false;
    if (!in_index) pattern += c;
    if (c == '[') in_index = true;
  }
  return folded(pattern);
}

class Finder {
 public:
  Finder(const iec::Project& project, std::span<const Symbol> symbols, std::span<const iec::DebugPou> pous)
      : project_(project) {
    for (std::size_t i = 0; i < pous.size(); ++i) numbers_.emplace(folded(pous[i].name), i);
    for (const Symbol& symbol : symbols) {
      const std::string name = folded(symbol.name);
      for (std::size_t dot = name.find('.'); dot != std::string::npos; dot = name.find('.', dot + 1))
        seen_.insert(name.substr(0, dot));
    }
  }

  std::vector<iec::DebugInstance> find(const iec::TaskPlan& plan) {
    for (const iec::PlannedTask& task : plan.tasks) {
      for (const iec::Program* const program : task.programs) {
        if (const iec::Pou* const type = project_.pou(program->type))
          add(*type, fmt::format("g_config.{}", folded(program->name)), program->name, 0);
      }
    }
    std::erase_if(found_, [this](const iec::DebugInstance& one) {
      return seen_pous_.contains(one.pou) && !seen_.contains(pattern_of(one.path));
    });
    return std::move(found_);
  }

 private:
  void add(const iec::Pou& pou, const std::string& value, const std::string& path, std::size_t depth) {
    if (depth > iec::kMostNested || path.size() > PLC_MAX_SYMBOL_NAME ||
        found_.size() >= PLC_MAX_POU_INSTANCES)
      return;
    if (const auto number = numbers_.find(folded(pou.name)); number != numbers_.end()) {
      found_.push_back({.pou = number->second, .value = value, .path = path});
      if (seen_.contains(pattern_of(path))) seen_pous_.insert(number->second);
    }
    for (const iec::Variable& variable : pou.variables) {
      if (const iec::Pou* const block = block_of(variable)) {
        add(*block, fmt::format("{}.{}", value, variable.member),
            fmt::format("{}.{}", path, name_in_path(variable)), depth + 1);
      }
    }
  }
  // None: it is no block, or one of others.
  [[nodiscard]] const iec::Pou* block_of(const iec::Variable& variable) const {
    using Section = iec::Variable::Section;
    const bool is_own = variable.section == Section::input || variable.section == Section::output ||
                        variable.section == Section::local;
    const iec::Pou* const pou = project_.pou(variable.type);
    const bool is_block = pou != nullptr && pou->kind == iec::Pou::Kind::function_block;
    return is_own && is_block && !variable.member.empty() ? pou : nullptr;
  }

  const iec::Project& project_;
  std::map<std::string, std::size_t> numbers_;  // of the POUs, by their folded names
  std::set<std::string> seen_;                  // instances with symbols
  std::set<std::size_t> seen_pous_;             // those of such instances
  std::vector<iec::DebugInstance> found_;
};

}  // namespace

std::vector<iec::DebugInstance> instances_of(const iec::Project& project, const iec::TaskPlan& plan,
                                             std::span<const Symbol> symbols,
                                             std::span<const iec::DebugPou> pous) {
  return Finder(project, symbols, pous).find(plan);
}

}  // namespace plchost::strucpp
