#include "instances/adapters/matiec/symbols.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"
#include "instances/plc_debug.h"
#include "instances/plc_variables.h"

namespace plchost::matiec {

namespace {

using iec::folded;
using iec::kMostNested;
using iec::Place;
using iec::PlannedTask;
using iec::TaskPlan;

constexpr std::size_t kMostDimensions = 3;  // PLC_MAX_DIMENSIONS

/// The types of MATIEC that have one value, and how that lies in memory.
struct ElementaryType {
  std::string_view name;
  unsigned type;
};
constexpr std::array<ElementaryType, 22> kElementary{{{"BOOL", PLC_TYPE_BOOL},
                                                      {"SINT", PLC_TYPE_SINT},
                                                      {"INT", PLC_TYPE_INT},
                                                      {"DINT", PLC_TYPE_DINT},
                                                      {"LINT", PLC_TYPE_LINT},
                                                      {"USINT", PLC_TYPE_USINT},
                                                      {"UINT", PLC_TYPE_UINT},
                                                      {"UDINT", PLC_TYPE_UDINT},
                                                      {"ULINT", PLC_TYPE_ULINT},
                                                      {"BYTE", PLC_TYPE_BYTE},
                                                      {"WORD", PLC_TYPE_WORD},
                                                      {"DWORD", PLC_TYPE_DWORD},
                                                      {"LWORD", PLC_TYPE_LWORD},
                                                      {"REAL", PLC_TYPE_REAL},
                                                      {"LREAL", PLC_TYPE_LREAL},
                                                      {"TIME", PLC_TYPE_TIMESPEC_TIME},
                                                      {"DATE", PLC_TYPE_TIMESPEC_DATE},
                                                      {"TOD", PLC_TYPE_TIMESPEC_TIME_OF_DAY},
                                                      {"TIME_OF_DAY", PLC_TYPE_TIMESPEC_TIME_OF_DAY},
                                                      {"DT", PLC_TYPE_TIMESPEC_DATE_AND_TIME},
                                                      {"DATE_AND_TIME", PLC_TYPE_TIMESPEC_DATE_AND_TIME},
                                                      {"STRING", PLC_TYPE_COUNTED_STRING}}};
std::optional<unsigned> elementary(std::string_view type) {
  const auto* const found = std::ranges::find(kElementary, type, &ElementaryType::name);
  return found == kElementary.end() ? std::nullopt : std::optional(found->type);
}

/// The variables of the function blocks in MATIEC's own library, which no source declares: TYPE NAME, ...
/// COUNTED is the type behind the `_` of the block's name, else INT. Those within are left out.
struct StandardBlock {
  std::string_view names;  // with blanks around each
  std::string_view members;
};
constexpr std::array kStandardBlocks{
    StandardBlock{" TON TOF TP ", "BOOL IN TIME PT BOOL Q TIME ET"},
    StandardBlock{" R_TRIG F_TRIG ", "BOOL CLK BOOL Q"},
    StandardBlock{" SR ", "BOOL S1 BOOL R BOOL Q1"},
    StandardBlock{" RS ", "BOOL S BOOL R1 BOOL Q1"},
    StandardBlock{" CTU CTU_DINT CTU_LINT CTU_UDINT CTU_ULINT ",
                  "BOOL CU BOOL R COUNTED PV BOOL Q COUNTED CV"},
    StandardBlock{" CTD CTD_DINT CTD_LINT CTD_UDINT CTD_ULINT ",
                  "BOOL CD BOOL LD COUNTED PV BOOL Q COUNTED CV"},
    StandardBlock{" CTUD CTUD_DINT CTUD_LINT CTUD_UDINT CTUD_ULINT ",
                  "BOOL CU BOOL CD BOOL R BOOL LD COUNTED PV BOOL QU BOOL QD COUNTED CV"},
    StandardBlock{" RTC ", "BOOL IN DT PDT BOOL Q DT CDT"},
    StandardBlock{" DERIVATIVE ", "BOOL RUN REAL XIN TIME CYCLE REAL XOUT"},
    StandardBlock{" HYSTERESIS ", "REAL XIN1 REAL XIN2 REAL EPS BOOL Q"},
    StandardBlock{" INTEGRAL ", "BOOL RUN BOOL R1 REAL XIN REAL X0 TIME CYCLE BOOL Q REAL XOUT"},
    StandardBlock{
        " PID ", "BOOL AUTO REAL PV REAL SP REAL X0 REAL KP REAL TR REAL TD TIME CYCLE REAL XOUT REAL ERROR"},
    StandardBlock{" RAMP ", "BOOL RUN REAL X0 REAL X1 TIME TR TIME CYCLE BOOL BUSY REAL XOUT"},
    StandardBlock{" SEMA ", "BOOL CLAIM BOOL RELEASE BOOL BUSY"}};

/// The words of a type, read one after the other.
class Words {
 public:
  explicit Words(std::string_view text) : tokens_(iec::tokens_of(text, "").all) {}
  [[nodiscard]] bool is(std::string_view word) const { return tokens_[at_].is(word); }
  [[nodiscard]] bool ended() const { return tokens_[at_].kind == iec::Token::Kind::end; }
  std::string take() {
    const std::string word = tokens_[at_].text;
    if (!ended()) ++at_;
    return word;
  }
  bool take(std::string_view word) {
    if (!is(word)) return false;
    ++at_;
    return true;
  }
  std::optional<int> number() {
    const bool negative = take("-");
    const std::string text = take();
    int value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return negative ? -value : value;
  }
  /// All up to one of these words, which is not taken, as a text.
  std::string until(std::initializer_list<std::string_view> words) {
    std::string text;
    for (int depth = 0; !ended(); at_ += 1) {
      if (depth == 0 && std::ranges::any_of(words, [&](auto word) { return is(word); })) break;
      if (is("(") || is("[")) ++depth;
      if (is(")") || is("]")) --depth;
      if (!text.empty()) text += ' ';
      text += tokens_[at_].text;
    }
    return text;
  }

 private:
  std::vector<iec::Token> tokens_;
  std::size_t at_ = 0;
};

/// The values that a variable has in C, and their types.
class ValueCollector {
 protected:
  explicit ValueCollector(const iec::Project& project) : project_(project) {}

  // Of a value that stands in C as `symbol.value`.
  void add_type(const iec::Variable& variable, Symbol symbol, const std::string& type, std::size_t depth) {
    if (depth > kMostNested) return;
    Words words(type.starts_with(iec::kReference) ? type.substr(iec::kReference.size()) : type);
    const std::string written = words.take();
    const std::string first = folded(written);
    if (first == "REF_TO") {
      leave_out(variable, symbol, "it is a reference");
    } else if (const auto known = elementary(first)) {
      symbol.type = *known;
      found_.all.push_back(std::move(symbol));
    } else if (first == "ARRAY") {
      add_array(variable, std::move(symbol), words, depth);
    } else if (first == "STRUCT") {
      add_structure(variable, symbol, words, depth);
    } else if (first == "(") {
      symbol.type = PLC_TYPE_DINT;  // an enumeration
      found_.all.push_back(std::move(symbol));
    } else if (const iec::DeclaredType* const declared = find_type(first)) {
      // "POINT : STRUCT ..."
      add_type(variable, std::move(symbol), declared->definition.substr(declared->definition.find(':') + 1),
               depth + 1);
    } else {
      leave_out(variable, symbol, fmt::format("its type {} is not known", written));
    }
  }

  void add_array(const iec::Variable& variable, Symbol symbol, Words& words, std::size_t depth) {
    symbol.value += ".table";
    const std::size_t begun = symbol.dimensions.size();
    if (!words.take("[")) return leave_out(variable, symbol, "its bounds are not understood");
    do {
      const auto first = words.number();
      const bool range = words.take("..");
      const auto last = words.number();
      if (!first || !range || !last || *last < *first)
        return leave_out(variable, symbol, "its bounds are no numbers");
      symbol.name += "[]";
      symbol.value += "[0]";
      symbol.dimensions.push_back({.first = *first,
                                   .count = static_cast<unsigned>(*last - *first) + 1,
                                   .stride = fmt::format("sizeof({})", symbol.value)});
    } while (words.take(","));
    if (symbol.dimensions.size() > kMostDimensions)
      return leave_out(variable, symbol, fmt::format("it has more than {} dimensions", kMostDimensions));
    if (!words.take("]") || !words.take("OF"))
      return leave_out(variable, symbol, "its type is not understood");
    const std::string element = words.until({":="});
    if (by_types_)
      iec::give_strides(std::span(symbol.dimensions).subspan(begun), size_of(element, depth + 1));
    add_type(variable, std::move(symbol), element, depth + 1);
  }

  // In C; 0u: it is not known. iec2c has no name for an array that is declared as a type.
  [[nodiscard]] std::string size_of(const std::string& type, std::size_t depth) const {
    Words words(type);
    const std::string first = folded(words.take());
    if (const auto known = elementary(first)) {
      if (*known == PLC_TYPE_TIMESPEC_TIME_OF_DAY) return "sizeof(TOD)";
      return *known == PLC_TYPE_TIMESPEC_DATE_AND_TIME ? "sizeof(DT)" : fmt::format("sizeof({})", first);
    }
    if (first == "ARRAY" && words.take("[")) {
      std::uint64_t elements = 1;
      do {
        const auto low = words.number();
        (void)words.take("..");
        const auto high = words.number();
        if (!low || !high || *high < *low) return "0u";
        elements *= static_cast<std::uint64_t>(std::int64_t{*high} - *low + 1);
      } while (words.take(","));
      (void)words.take("]");
      (void)words.take("OF");
      return fmt::format("{}u * {}", elements, size_of(words.until({":="}), depth + 1));
    }
    const iec::DeclaredType* const declared = depth > kMostNested ? nullptr : find_type(first);
    if (declared == nullptr) return "0u";
    const std::string definition = declared->definition.substr(declared->definition.find(':') + 1);
    const Words inner(definition);
    const bool has_name = inner.is("STRUCT") || inner.is("(");
    return has_name ? fmt::format("sizeof({})", first) : size_of(definition, depth + 1);
  }

  void add_structure(const iec::Variable& variable, const Symbol& within, Words& words, std::size_t depth) {
    while (!words.ended() && !words.is("END_STRUCT")) {
      std::vector<std::string> names{words.take()};
      while (words.take(",")) names.push_back(words.take());
      if (!words.take(":")) return leave_out(variable, within, "its structure is not understood");
      const std::string type = words.until({";", ":="});
      (void)words.until({";"});
      (void)words.take(";");
      for (const std::string& name : names) {
        Symbol member = within;
        member.name += "." + name;
        member.value += "." + folded(name);
        add_type(variable, std::move(member), type, depth + 1);
      }
    }
  }

  [[nodiscard]] const iec::DeclaredType* find_type(const std::string& name) const {
    const auto found = std::ranges::find_if(
        project_.types, [&](const iec::DeclaredType& known) { return folded(known.name) == name; });
    return found == project_.types.end() ? nullptr : &*found;
  }

  // Once for each declaration, however often its block is used.
  void leave_out(const iec::Variable& variable, const Symbol& symbol, const std::string& why) {
    if (!told_.insert(fmt::format("{}:{}:{}", variable.place.file, variable.place.line, symbol.name)).second)
      return;
    found_.remarks.push_back(
        {variable.place, fmt::format("{} cannot be seen from outside: {}", symbol.name, why)});
  }

  const iec::Project& project_;
  bool by_types_ = false;  // strides are those of types, not of a variable
  std::set<std::string> told_;
  Symbols found_;
};

class Collector : ValueCollector {
 public:
  Collector(const iec::Project& project, const iec::Resource& resource, const TaskPlan& plan,
            const ValueOfPlace& value_of_place)
      : ValueCollector(project), resource_(resource), plan_(plan), value_of_place_(value_of_place) {}

  Symbols collect() {
    for (std::size_t i = 0; i < plan_.tasks.size(); ++i) {
      task_ = i;
      for (const iec::Program* const program : plan_.tasks[i].programs)
        add_program(*program, plan_.tasks[i].name);
    }
    task_.reset();
    for (const auto& [name, variable] : plan_.globals) add_global(name, *variable);
    std::ranges::sort(found_.all, {}, [](const Symbol& symbol) { return folded(symbol.name); });
    const auto twice =
        std::ranges::unique(found_.all, {}, [](const Symbol& symbol) { return folded(symbol.name); });
    found_.all.erase(twice.begin(), twice.end());
    return std::move(found_);
  }

 private:
  void add_program(const iec::Program& program, const std::string& task) {
    const iec::Pou* const type = project_.pou(program.type);
    if (type == nullptr) return;
    const std::string resource = resource_.name.empty() ? "RESOURCE" : folded(resource_.name);
    Symbol within;
    within.name = program.name + ".";
    within.value = resource + "__" + folded(program.name) + ".";
    within.task = task;
    add_all(*type, within, 0);
  }

  void add_global(const std::string& name, const iec::Variable& variable) {
    Symbol symbol;
    symbol.name = variable.name;
    symbol.task = only_user_of(name);
    symbol.read_only = variable.constant;
    if (!variable.location.empty()) return add_located(variable, std::move(symbol));
    if (variable.constant) return;  // a constant of the C compiler
    symbol.value = fmt::format("(*__GET_GLOBAL_{}())", name);
    if (add_block(variable.type, symbol, 0)) return;
    add_type(variable, std::move(symbol), variable.type, 0);
  }
  // Empty: none, or several.
  [[nodiscard]] std::string only_user_of(const std::string& global) const {
    std::string user;
    for (const PlannedTask& task : plan_.tasks) {
      if (!task.globals.contains(global)) continue;
      if (!user.empty()) return "";
      user = task.name;
    }
    return user;
  }

  void add_all(const iec::Pou& pou, const Symbol& within, std::size_t depth) {
    if (depth > kMostNested) return;
    found_.instances.push_back({.path = within.name.substr(0, within.name.size() - 1),
                                .value = within.value.substr(0, within.value.size() - 1),
                                .type = folded(pou.name)});
    for (const iec::Variable& variable : pou.variables) {
      using Section = iec::Variable::Section;
      const bool is_own = variable.section == Section::input || variable.section == Section::output ||
                          variable.section == Section::local;
      if (!is_own || variable.constant) continue;
      Symbol symbol = within;
      symbol.name += variable.name;
      if (!variable.location.empty()) {
        add_located(variable, std::move(symbol));
        continue;
      }
      symbol.value += folded(variable.name);
      add_member(variable, std::move(symbol), depth);
    }
  }

  // A function block is a structure by itself, all else has its value in one.
  void add_member(const iec::Variable& variable, Symbol symbol, std::size_t depth) {
    if (add_block(variable.type, symbol, depth + 1)) return;
    symbol.value += ".value";
    add_type(variable, std::move(symbol), variable.type, depth);
  }

  // false: it is no function block.
  bool add_block(std::string_view declared, Symbol symbol, std::size_t depth) {
    const std::string type = folded(Words(declared).take());
    if (const iec::Pou* const block = project_.pou(type)) {
      symbol.name += ".";
      symbol.value += ".";
      add_all(*block, symbol, depth);
      return true;
    }
    const auto* const standard = std::ranges::find_if(kStandardBlocks, [&](const StandardBlock& known) {
      return known.names.find(fmt::format(" {} ", type)) != std::string_view::npos;
    });
    if (standard == kStandardBlocks.end()) return false;
    const std::size_t suffix = type.starts_with("CT") ? type.find('_') : std::string::npos;
    add_standard(*standard, suffix == std::string::npos ? "INT" : type.substr(suffix + 1), symbol);
    return true;
  }

  void add_standard(const StandardBlock& block, std::string_view counted, const Symbol& within) {
    Words words(block.members);
    while (!words.ended()) {
      Symbol symbol = within;
      const std::string type = words.take();
      symbol.type = *elementary(type == "COUNTED" ? counted : type);
      const std::string member = words.take();
      symbol.name += "." + member;
      symbol.value += "." + member + ".value";
      found_.all.push_back(std::move(symbol));
    }
  }

  void add_located(const iec::Variable& variable, Symbol symbol) {
    const auto place = plan_.locations.place(variable.location);
    symbol.value = place ? value_of_place_(*place, task_) : "";
    if (symbol.value.empty()) return;  // its declaration is refused elsewhere
    symbol.area = variable.location;
    add_type(variable, std::move(symbol), variable.type, 0);
  }

  const iec::Resource& resource_;
  const TaskPlan& plan_;
  const ValueOfPlace& value_of_place_;
  std::optional<std::size_t> task_;  // of the programs that are looked at; nothing: globals
};

/// Those of a POU that are no symbols.
class LocalCollector : ValueCollector {
 public:
  explicit LocalCollector(const iec::Project& project) : ValueCollector(project) { by_types_ = true; }

  std::vector<iec::DebugLocal> collect(const iec::Pou& pou) {
    const bool is_function = pou.kind == iec::Pou::Kind::function;
    for (const iec::Variable& variable : pou.variables) {
      if (is_local(variable, is_function)) add(variable, is_function);
    }
    if (!pou.result.empty())
      add({.name = pou.name, .type = pou.result, .location = "", .place = pou.place}, is_function);
    std::vector<iec::DebugLocal> locals;
    for (const Symbol& symbol : found_.all) {
      if (symbol.name.size() > PLC_MAX_SYMBOL_NAME) continue;
      if (locals.size() == PLC_MAX_POU_LOCALS) break;
      iec::DebugLocal local{.name = symbol.name,
                            .type = fmt::format("{}u", symbol.type),
                            .bytes = symbol.type == PLC_TYPE_COUNTED_STRING ? "sizeof(STRING)" : "0",
                            .address = "&" + symbol.value};
      for (const Symbol::Dimension& one : symbol.dimensions)
        local.dimensions.push_back({.first = one.first, .count = one.count, .stride = one.stride});
      if (iec::are_allowed(local.dimensions)) locals.push_back(std::move(local));
    }
    return locals;
  }

 private:
  static bool is_local(const iec::Variable& variable, bool of_function) {
    using Section = iec::Variable::Section;
    if (variable.name.empty() || !variable.location.empty()) return false;
    switch (variable.section) {
      case Section::in_out:
      case Section::temporary:
        return true;
      case Section::input:
      case Section::output:
      case Section::local:
        return of_function;
      case Section::external:
      case Section::global:
      case Section::other:
        return false;
    }
    return false;
  }
  void add(const iec::Variable& variable, bool of_function) {
    Symbol symbol;
    symbol.name = variable.name;
    symbol.value =
        of_function ? folded(variable.name) : fmt::format("data__->{}.value", folded(variable.name));
    add_type(variable, std::move(symbol), variable.type, 0);
  }
};

}  // namespace

std::vector<iec::DebugLocal> locals_of(const iec::Project& project, const iec::Pou& pou) {
  return LocalCollector(project).collect(pou);
}

Symbols symbols_of(const iec::Project& project, const iec::Resource& resource, const TaskPlan& plan,
                   const ValueOfPlace& value_of_place) {
  return Collector(project, resource, plan, value_of_place).collect();
}

}  // namespace plchost::matiec
