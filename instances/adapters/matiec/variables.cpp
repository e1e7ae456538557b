#include "instances/adapters/matiec/variables.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"

namespace plchost::matiec {

namespace {

using iec::folded;

constexpr std::size_t kMostNested = 32;

/// They hold times of a clock that begins anew when the machine does.
constexpr std::array<std::string_view, 3> kTimers{"TON", "TOF", "TP"};
constexpr std::array<std::string_view, 22> kElementary{
    "BOOL", "SINT", "INT", "DINT", "LINT",   "USINT", "UINT", "UDINT", "ULINT", "REAL",  "LREAL",
    "TIME", "DATE", "TOD", "DT",   "STRING", "BYTE",  "WORD", "DWORD", "LWORD", "ARRAY", "TIME_OF_DAY"};

std::uint64_t hash_of(std::string_view text, std::uint64_t seed = 0xcbf29ce484222325U) {
  for (const char letter : text) seed = (seed ^ static_cast<unsigned char>(letter)) * 0x100000001b3U;
  return seed;
}

std::string first_word(const std::string& type) {
  return folded(type.substr(0, type.find_first_of(" ([")));
}

class Collector {
 public:
  Collector(const iec::Project& project, const iec::Resource& resource, const TaskPlan& plan)
      : project_(project), resource_(resource), plan_(plan) {}

  ProgramVariables collect() {
    found_.retained.resize(plan_.tasks.size());
    for (std::size_t i = 0; i < plan_.tasks.size(); ++i) {
      for (const iec::Program* const program : plan_.tasks[i].programs) add_program(*program, i);
    }
    for (const auto& [name, variable] : plan_.globals) add_global(name, *variable);
    return std::move(found_);
  }

 private:
  /// Where a variable stands.
  struct Within {
    std::string path;   // with a dot at its end
    std::string value;  // the same
    bool retain = false;
    std::size_t depth = 0;
  };

  void add_program(const iec::Program& program, std::size_t task) {
    const iec::Pou* const type = project_.pou(program.type);
    if (type == nullptr) return;
    const std::size_t before = found_.all.size();
    const std::string resource = resource_.name.empty() ? "RESOURCE" : folded(resource_.name);
    const std::string name = folded(program.name);
    add_all(*type, {name + ".", resource + "__" + name + ".", program.retain, 0});
    for (std::size_t i = before; i < found_.all.size(); ++i) {
      if (found_.all[i].retain) found_.retained[task].push_back(i);
    }
  }

  void add_global(const std::string& name, const iec::Variable& variable) {
    if (variable.constant || !variable.location.empty()) return;
    if (!is_data(first_word(variable.type))) return;  // an instance of a function block
    if (variable.retain) {
      for (std::size_t i = 0; i < plan_.tasks.size(); ++i) {
        if (plan_.tasks[i].globals.contains(name)) found_.retained[i].push_back(found_.all.size());
      }
    }
    found_.all.push_back(
        {name, fmt::format("*__GET_GLOBAL_{}()", name), layout_of(variable.type), variable.retain});
  }

  void add_all(const iec::Pou& pou, const Within& within) {
    if (within.depth > kMostNested) return;
    for (const iec::Variable& variable : pou.variables) {
      using Section = iec::Variable::Section;
      const bool is_own = variable.section == Section::input || variable.section == Section::output ||
                          variable.section == Section::local;
      if (is_own && !variable.constant && variable.location.empty()) add(variable, within);
    }
    if (!pou.chart.empty()) add_steps(pou, within);
  }

  void add(const iec::Variable& variable, const Within& within) {
    const std::string type = first_word(variable.type);
    const std::string name = folded(variable.name);
    const bool retain = within.retain || variable.retain;
    if (is_data(type)) {
      return found_.all.push_back(
          {within.path + name, within.value + name + ".value", layout_of(variable.type), retain});
    }
    const iec::Pou* const block = project_.pou(type);
    if (block != nullptr) {
      return add_all(*block, {within.path + name + ".", within.value + name + ".", retain, within.depth + 1});
    }
    const bool is_timer = std::ranges::find(kTimers, type) != kTimers.end();
    if (is_timer && retain) {
      found_.remarks.push_back(
          {variable.place,
           fmt::format("{} is a {}: a timer begins anew at each start, RETAIN or not", variable.name, type)});
    }
    found_.all.push_back(
        {within.path + name, within.value + name, layout_of(variable.type), retain && !is_timer});
  }

  // Which steps of a sequential function chart are active, and since when. With other steps they mean
  // something else.
  void add_steps(const iec::Pou& pou, const Within& within) {
    for (const std::string_view list : {"step_list", "action_list", "lasttick_time"}) {
      found_.all.push_back({fmt::format("{}SFC.{}", within.path, list),
                            fmt::format("{}__{}", within.value, list), hash_of(pou.chart), false});
    }
  }

  [[nodiscard]] bool is_data(const std::string& type) const {
    return std::ranges::find(kElementary, type) != kElementary.end() || type == "DATE_AND_TIME" ||
           declared(type) != nullptr;
  }
  [[nodiscard]] const iec::DeclaredType* declared(const std::string& type) const {
    const auto found = std::ranges::find_if(
        project_.types, [&](const iec::DeclaredType& known) { return folded(known.name) == type; });
    return found == project_.types.end() ? nullptr : &*found;
  }
  // Of its words, and of those of the types that are named in it.
  [[nodiscard]] std::uint64_t layout_of(const std::string& type, std::size_t depth = 0) const {
    const std::string text = folded(type);
    std::uint64_t hash = hash_of(text);
    for (const iec::DeclaredType& known : project_.types) {
      if (depth > kMostNested || !names(text, folded(known.name))) continue;
      hash = hash_of(fmt::format("{}", layout_of(known.definition, depth + 1)), hash);
    }
    return hash;
  }
  // Whether the name is one of the words of the text.
  static bool names(std::string_view text, std::string_view name) {
    const auto is_letter = [&](std::size_t at) {
      return at < text.size() && (std::isalnum(static_cast<unsigned char>(text[at])) != 0 || text[at] == '_');
    };
    for (std::size_t at = text.find(name); at != std::string_view::npos; at = text.find(name, at + 1)) {
      if (!is_letter(at - 1) && !is_letter(at + name.size())) return true;
    }
    return false;
  }

  const iec::Project& project_;
  const iec::Resource& resource_;
  const TaskPlan& plan_;
  ProgramVariables found_;
};

}  // namespace

ProgramVariables variables_of(const iec::Project& project, const iec::Resource& resource,
                              const TaskPlan& plan) {
  return Collector(project, resource, plan).collect();
}

}  // namespace plchost::matiec
