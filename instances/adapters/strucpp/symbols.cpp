#include "instances/adapters/strucpp/symbols.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"
#include "instances/plc_variables.h"

namespace plchost::strucpp {

namespace {

using iec::folded;

/// The types of the table for debuggers. Times are nanoseconds, but a date is days.
struct TableType {
  std::string_view name;
  unsigned type;
  unsigned bytes;
};
constexpr std::array<TableType, 21> kTypes{{{"BOOL", PLC_TYPE_BOOL, 1},
                                            {"SINT", PLC_TYPE_SINT, 1},
                                            {"INT", PLC_TYPE_INT, 2},
                                            {"DINT", PLC_TYPE_DINT, 4},
                                            {"LINT", PLC_TYPE_LINT, 8},
                                            {"USINT", PLC_TYPE_USINT, 1},
                                            {"UINT", PLC_TYPE_UINT, 2},
                                            {"UDINT", PLC_TYPE_UDINT, 4},
                                            {"ULINT", PLC_TYPE_ULINT, 8},
                                            {"BYTE", PLC_TYPE_BYTE, 1},
                                            {"WORD", PLC_TYPE_WORD, 2},
                                            {"DWORD", PLC_TYPE_DWORD, 4},
                                            {"LWORD", PLC_TYPE_LWORD, 8},
                                            {"REAL", PLC_TYPE_REAL, 4},
                                            {"LREAL", PLC_TYPE_LREAL, 8},
                                            {"TIME", PLC_TYPE_TIME, 8},
                                            {"DATE", PLC_TYPE_DAYS_DATE, 8},
                                            {"TOD", PLC_TYPE_TIME_OF_DAY, 8},
                                            {"DT", PLC_TYPE_DATE_AND_TIME, 8},
                                            {"STRING", PLC_TYPE_SIZED_STRING, 0},
                                            {"WSTRING", PLC_TYPE_SIZED_WSTRING, 0}}};

/// A word of a path, and the "[]" behind it.
struct Step {
  std::string_view word;
  std::string_view brackets;
};
std::vector<Step> steps_of(std::string_view path) {
  std::vector<Step> steps;
  for (bool more = true; more;) {
    const std::size_t dot = path.find('.');
    const std::string_view part = path.substr(0, dot);
    const std::size_t end = std::min(part.find('['), part.size());
    steps.push_back({.word = part.substr(0, end), .brackets = part.substr(end)});
    more = dot != std::string_view::npos;
    if (more) path.remove_prefix(dot + 1);
  }
  return steps;
}

/// In C++: plchost_at(c.ONE.GRID, i0, i1).X
std::string value_of(std::span<const Step> steps) {
  std::string value = "c";
  std::size_t index = 0;
  for (const Step& step : steps) {
    if (!step.word.empty()) value += fmt::format(".{}", step.word);
    if (step.brackets.empty()) continue;
    std::string indexes;
    for (std::size_t i = 0; i < step.brackets.size() / 2; ++i) indexes += fmt::format(", i{}", index++);
    value = fmt::format("plchost_at({}{})", value, indexes);
  }
  return value;
}

class Resolver {
 public:
  Resolver(const iec::Project& project, const iec::TaskPlan& plan) : project_(project), plan_(plan) {}

  Symbols resolve(std::span<const PlannedSymbol> planned) {
    for (const PlannedSymbol& one : planned) add(one);
    return std::move(found_);
  }

 private:
  void add(const PlannedSymbol& planned) {
    const std::vector<Step> names = steps_of(planned.name);
    const std::vector<Step> values = steps_of(planned.value);
    const std::string first = folded(names.front().word);
    const bool is_hidden = !planned.hidden.empty();
    Symbol symbol;
    symbol.bounds = planned.bounds;
    place_ = {};
    if (names.size() > 1 && (is_hidden ? is_program(first) : values.front().word == "g_config")) {
      if (!in_program(names, symbol)) return;
      symbol.root = "g_config";
    } else if (const auto global = plan_.globals.find(first); global != plan_.globals.end()) {
      symbol.root = fmt::format("strucpp::{}", values.front().word);
      symbol.task = only_user_of(first);
      if (!follow(symbol, *global->second, names.front()) || !within(symbol, *global->second, names, 1))
        return;
    } else {
      return;  // of another resource
    }
    if (is_hidden) return leave_out(symbol.name, planned.hidden);
    symbol.value = value_of(std::span(values).subspan(1));
    give_type(planned, std::move(symbol));
  }
  [[nodiscard]] bool is_program(const std::string& name) const {
    return std::ranges::any_of(plan_.tasks, [&](const iec::PlannedTask& task) {
      return std::ranges::any_of(task.programs,
                                 [&](const iec::Program* program) { return folded(program->name) == name; });
    });
  }
  // Once for each name.
  void leave_out(const std::string& name, const std::string& why) {
    if (!told_.insert(name).second) return;
    found_.remarks.push_back({place_, fmt::format("{} cannot be seen from outside: {}", name, why)});
  }

  // Whether it can be seen.
  bool in_program(const std::vector<Step>& names, Symbol& symbol) {
    for (const iec::PlannedTask& task : plan_.tasks) {
      for (const iec::Program* const program : task.programs) {
        if (folded(program->name) != folded(names.front().word)) continue;
        symbol.name = program->name;
        symbol.task = task.name;
        return within(symbol, project_.pou(program->type), names, 1);
      }
    }
    return false;
  }
  bool within(Symbol& symbol, const iec::Variable& variable, const std::vector<Step>& names, std::size_t at) {
    return within(symbol, block_of(variable), names, at);
  }
  // Names that no source of this program declares, as those of a structure, are upper case.
  bool within(Symbol& symbol, const iec::Pou* pou, const std::vector<Step>& names, std::size_t at) {
    for (; at < names.size(); ++at) {
      symbol.name += '.';
      const iec::Variable* const variable = pou == nullptr ? nullptr : find(*pou, names[at].word);
      if (variable == nullptr) {
        symbol.name.append(names[at].word).append(names[at].brackets);
        pou = nullptr;
        continue;
      }
      if (!follow(symbol, *variable, names[at])) return false;
      pou = block_of(*variable);
    }
    return true;
  }
  // An array of function blocks stands in the project as its elements: PUMPS.1, PUMPS.2.
  static const iec::Variable* find(const iec::Pou& pou, std::string_view word) {
    const auto found = std::ranges::find_if(pou.variables, [&](const iec::Variable& variable) {
      const std::string name = folded(variable.name);
      return name == word || (name.starts_with(word) && name[word.size()] == '.');
    });
    return found == pou.variables.end() ? nullptr : &*found;
  }
  bool follow(Symbol& symbol, const iec::Variable& variable, const Step& step) {
    symbol.name.append(variable.name, 0, step.word.size()).append(step.brackets);
    place_ = variable.place;
    symbol.area = variable.location;
    symbol.read_only = symbol.read_only || variable.constant;
    if (!variable.type.starts_with(iec::kReference)) return true;
    leave_out(symbol.name, "it has references");
    return false;
  }
  [[nodiscard]] const iec::Pou* block_of(const iec::Variable& variable) const {
    const std::size_t of = variable.type.rfind(" OF ");
    const iec::Pou* const pou =
        project_.pou(of == std::string::npos ? variable.type : variable.type.substr(of + 4));
    return pou != nullptr && pou->kind == iec::Pou::Kind::function_block ? pou : nullptr;
  }
  // Empty: none, or several.
  [[nodiscard]] std::string only_user_of(const std::string& global) const {
    std::string user;
    for (const iec::PlannedTask& task : plan_.tasks) {
      if (!task.globals.contains(global)) continue;
      if (!user.empty()) return "";
      user = task.name;
    }
    return user;
  }

  void give_type(const PlannedSymbol& planned, Symbol symbol) {
    const auto* const type = std::ranges::find(kTypes, planned.type, &TableType::name);
    if (type == kTypes.end()) return leave_out(symbol.name, fmt::format("its type is {}", planned.type));
    if (symbol.bounds.size() > PLC_MAX_DIMENSIONS)
      return leave_out(symbol.name, fmt::format("it has more than {} dimensions", PLC_MAX_DIMENSIONS));
    if (symbol.name.size() > PLC_MAX_SYMBOL_NAME)
      return leave_out(symbol.name, fmt::format("its name has more than {} characters", PLC_MAX_SYMBOL_NAME));
    symbol.type = type->type;
    symbol.bytes = type->bytes;
    found_.all.push_back(std::move(symbol));
  }

  const iec::Project& project_;
  const iec::TaskPlan& plan_;
  iec::SourcePlace place_;  // of the innermost declaration that is known
  std::set<std::string> told_;
  Symbols found_;
};

}  // namespace

unsigned type_number(std::string_view name) noexcept {
  const auto* const type = std::ranges::find(kTypes, name, &TableType::name);
  return type == kTypes.end() || type->bytes == 0 ? 0 : type->type;
}

Symbols symbols_of(const iec::Project& project, const iec::TaskPlan& plan,
                   std::span<const PlannedSymbol> planned) {
  return Resolver(project, plan).resolve(planned);
}

}  // namespace plchost::strucpp
