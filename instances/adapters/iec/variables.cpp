#include "instances/adapters/iec/variables.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/c_texts.hpp"
#include "instances/adapters/iec/tokens.hpp"

namespace plchost::iec {

namespace {

/// They hold times of a clock that begins anew when the machine does.
constexpr std::array<std::string_view, 3> kTimers{"TON", "TOF", "TP"};
constexpr std::array<std::string_view, 22> kElementary{
    "BOOL", "SINT", "INT", "DINT", "LINT",   "USINT", "UINT", "UDINT", "ULINT", "REAL",  "LREAL",
    "TIME", "DATE", "TOD", "DT",   "STRING", "BYTE",  "WORD", "DWORD", "LWORD", "ARRAY", "TIME_OF_DAY"};

std::uint64_t hash_of(std::string_view text, std::uint64_t seed = 0xcbf29ce484222325U) {
  for (const char letter : text) seed = (seed ^ static_cast<unsigned char>(letter)) * 0x100000001b3U;
  return seed;
}

std::string first_word(std::string_view type) {
  return folded(type.substr(0, type.find_first_of(" ([")));
}

class VariableCollector {
 public:
  VariableCollector(const Project& project, const Resource& resource, const TaskPlan& plan, Compiler compiler)
      : project_(project), resource_(resource), plan_(plan), compiler_(compiler) {}

  ProgramVariables collect() {
    found_.retained.resize(plan_.tasks.size());
    for (std::size_t i = 0; i < plan_.tasks.size(); ++i) {
      for (const Program* const program : plan_.tasks[i].programs) add_program(*program, i);
    }
    for (const auto& [name, variable] : plan_.globals) add_global(name, *variable);
    return std::move(found_);
  }

 private:
  /// Where a variable stands, or those in a block: then with dots at their ends.
  struct Within {
    std::string path;
    std::string value;
    bool retain = false;
    std::size_t depth = 0;
  };

  void add_program(const Program& program, std::size_t task) {
    const Pou* const type = project_.pou(program.type);
    if (type == nullptr) return;
    const std::size_t before = found_.all.size();
    add_all(*type, {folded(program.name) + ".", instance_in_c(resource_, program, compiler_) + ".",
                    program.retain, 0});
    add_retained(before, task);
  }

  void add_global(const std::string& name, const Variable& variable) {
    if (variable.constant || !variable.location.empty() || !is_kept(variable)) return;
    const std::size_t before = found_.all.size();
    const std::string value = compiler_ == Compiler::strucpp ? "strucpp::" + variable.member
                                                             : fmt::format("(*__GET_GLOBAL_{}())", name);
    add(variable, {name, value, variable.retain, 0}, "");
    for (std::size_t task = 0; task < plan_.tasks.size(); ++task) {
      if (plan_.tasks[task].globals.contains(name)) add_retained(before, task);
    }
  }
  void add_retained(std::size_t from, std::size_t task) {
    for (std::size_t i = from; i < found_.all.size(); ++i) {
      if (found_.all[i].retain) found_.retained[task].push_back(i);
    }
  }

  void add_all(const Pou& pou, const Within& within) {
    if (within.depth > kMostNested) return;
    for (const Variable& variable : pou.variables) {
      using Section = Variable::Section;
      const bool is_own = variable.section == Section::input || variable.section == Section::output ||
                          variable.section == Section::local;
      if (is_own && !variable.constant && variable.location.empty() && is_kept(variable))
        add_member(variable, within);
    }
    if (!pou.chart.empty()) add_steps(pou, within);
  }

  void add_member(const Variable& variable, const Within& within) {
    const std::string member = variable.member.empty() ? folded(variable.name) : variable.member;
    const bool has_flags = compiler_ == Compiler::matiec && is_data(project_, variable.type);
    add(variable,
        {within.path + folded(variable.name), within.value + member, within.retain || variable.retain,
         within.depth},
        has_flags ? ".value" : "");
  }
  // `end`: behind the name of one that is no block of the program, as there it is followed by flags.
  void add(const Variable& variable, Within at, std::string_view end) {
    const std::string type = first_word(variable.type);
    const bool is_timer = std::ranges::find(kTimers, type) != kTimers.end();
    if (is_timer && at.retain) {
      found_.remarks.push_back(
          {variable.place,
           fmt::format("{} is a {}: a timer begins anew at each start, RETAIN or not", variable.name, type)});
      at.retain = false;
    }
    if (const Pou* const block = project_.pou(type))
      return add_all(*block, {at.path + ".", at.value + ".", at.retain, at.depth + 1});
    found_.all.push_back(
        {std::move(at.path), fmt::format("{}{}", at.value, end), layout_of(variable.type), at.retain});
  }
  // One that points into this version of the program means nothing in another one.
  bool is_kept(const Variable& variable) {
    if (!variable.type.starts_with(kReference)) return true;
    if (variable.retain) {
      found_.remarks.push_back(
          {variable.place, fmt::format("RETAIN of {} is not carried out: it has references", variable.name)});
    }
    return false;
  }

  // Which steps of a sequential function chart are active, and since when. With other steps they mean
  // something else.
  void add_steps(const Pou& pou, const Within& within) {
    for (const std::string_view list : {"step_list", "action_list", "lasttick_time"}) {
      found_.all.push_back({fmt::format("{}SFC.{}", within.path, list),
                            fmt::format("{}__{}", within.value, list), hash_of(pou.chart), false});
    }
  }

  // Of its words, and of those of the types that are named in it.
  [[nodiscard]] std::uint64_t layout_of(const std::string& type, std::size_t depth = 0) const {
    const std::string text = folded(type);
    std::uint64_t hash = hash_of(text);
    for (const DeclaredType& known : project_.types) {
      if (depth > kMostNested || !names(text, folded(known.name))) continue;
      hash = hash_of(fmt::format("{}", layout_of(known.definition, depth + 1)), hash);
    }
    return hash;
  }
  // Whether the name is one of the words of the text.
  static bool names(std::string_view text, std::string_view name) {
    const auto is_letter = [&](std::size_t at) { return at < text.size() && is_of_name(text[at]); };
    for (std::size_t at = text.find(name); at != std::string_view::npos; at = text.find(name, at + 1)) {
      if (!is_letter(at - 1) && !is_letter(at + name.size())) return true;
    }
    return false;
  }

  const Project& project_;
  const Resource& resource_;
  const TaskPlan& plan_;
  Compiler compiler_;
  ProgramVariables found_;
};

}  // namespace

std::string instance_in_c(const Resource& resource, const Program& program, Compiler compiler) {
  const std::string name = folded(program.name);
  if (compiler == Compiler::strucpp) return "g_config." + name;
  return (resource.name.empty() ? "RESOURCE" : folded(resource.name)) + "__" + name;
}

bool is_data(const Project& project, std::string_view type) {
  const std::string name = first_word(type);
  return std::ranges::find(kElementary, name) != kElementary.end() || name == "DATE_AND_TIME" ||
         std::ranges::any_of(project.types,
                             [&](const DeclaredType& known) { return folded(known.name) == name; });
}

ProgramVariables variables_of(const Project& project, const Resource& resource, const TaskPlan& plan,
                              Compiler compiler) {
  return VariableCollector(project, resource, plan, compiler).collect();
}

}  // namespace plchost::iec
