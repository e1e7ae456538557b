#include "instances/adapters/iec/copies.hpp"

#include <algorithm>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/iec/variables.hpp"

namespace plchost::iec {

namespace {

class CopyCollector {
 public:
  CopyCollector(const Project& project, const TaskPlan& plan, const Program& program, Compiler compiler)
      : project_(project), plan_(plan), program_(program), compiler_(compiler) {}

  ProgramCopies collect(const std::string& instance) {
    if (const Pou* const type = project_.pou(program_.type)) visit(*type, instance + ".", 0);
    // A part of the program would see the copy, and another one the global.
    std::erase_if(found_.all, [&](const CopiedGlobal& one) { return left_out_.contains(one.name); });
    return std::move(found_);
  }

 private:
  void visit(const Pou& pou, const std::string& within, std::size_t depth) {
    if (depth > kMostNested) return;
    for (const Variable& variable : pou.variables) {
      using Section = Variable::Section;
      const std::string value = within + (variable.member.empty() ? folded(variable.name) : variable.member);
      if (variable.section == Section::external) {
        add(variable, value);
        continue;
      }
      const Pou* const block = project_.pou(variable.type);
      if (block == nullptr) continue;
      if (variable.section == Section::input || variable.section == Section::output ||
          variable.section == Section::local || is_call(variable)) {
        visit(*block, value + ".", depth + 1);
      } else if (variable.section != Section::in_out) {  // that is one of these, or a global
        leave_out_of(*block);
      }
    }
  }
  // A function that the POU calls. It has no variables that last, and no VAR_EXTERNAL of its own.
  static bool is_call(const Variable& variable) { return variable.name.starts_with("CALL."); }

  void add(const Variable& external, const std::string& value) {
    const std::string name = folded(external.name);
    const auto global = plan_.globals.find(name);
    if (global != plan_.globals.end() && global->second->constant) return;
    if (global == plan_.globals.end()) return leave_out(external, name, "it is not found among the globals");
    if (!is_data(project_, global->second->type)) {
      if (const Pou* const block = project_.pou(global->second->type)) leave_out_of(*block);
      return leave_out(external, name, "it is a function block, or has references");
    }
    if (compiler_ == Compiler::strucpp && external.member.empty())
      return leave_out(external, name, "a part of the program uses it without VAR_EXTERNAL");
    auto found = std::ranges::find(found_.all, name, &CopiedGlobal::name);
    if (found == found_.all.end()) {
      found = found_.all.insert(found, {.name = name,
                                        .variable = global->second,
                                        .externals = {},
                                        .dimensions = dimensions_of(global->second->type, 0)});
    }
    found->externals.push_back(value);
  }
  // Of a block that is not in the memory of the program: its VAR_EXTERNAL remain the globals.
  void leave_out_of(const Pou& block) {
    if (!outside_.insert(&block).second) return;
    for (const Variable& variable : block.variables) {
      const std::string name = folded(variable.name);
      const auto global = plan_.globals.find(name);
      const bool constant = global != plan_.globals.end() && global->second->constant;
      if (variable.section == Variable::Section::external && !constant)
        leave_out(variable, name, fmt::format("{} uses it, and is global or temporary", block.name));
      if (const Pou* const inner = project_.pou(variable.type)) leave_out_of(*inner);
    }
  }
  void leave_out(const Variable& external, const std::string& name, std::string_view why) {
    if (!left_out_.insert(name).second) return;
    found_.remarks.push_back(
        {external.place, fmt::format("PROGRAM {} has no copy of {}: {}", program_.name, external.name, why)});
  }

  // "ARRAY [1..3, 0..1] OF INT" has 2.
  [[nodiscard]] std::size_t dimensions_of(const std::string& type, std::size_t depth) const {
    const Tokens tokens = tokens_of(type, "");
    if (!tokens.all.front().is("ARRAY")) {
      const auto declared = std::ranges::find_if(project_.types, [&](const DeclaredType& known) {
        return folded(known.name) == folded(tokens.all.front().text);
      });
      if (declared == project_.types.end() || depth > kMostNested) return 0;
      return dimensions_of(declared->definition.substr(declared->definition.find(':') + 1), depth + 1);
    }
    std::size_t dimensions = 1;
    for (const Token& token : tokens.all) {
      if (token.is("]")) break;
      if (token.is(",")) ++dimensions;
    }
    return dimensions;
  }

  const Project& project_;
  const TaskPlan& plan_;
  const Program& program_;
  Compiler compiler_;
  std::set<std::string> left_out_;
  std::set<const Pou*> outside_;
  ProgramCopies found_;
};

}  // namespace

ProgramCopies copies_of(const Project& project, const Resource& resource, const TaskPlan& plan,
                        const Program& program, Compiler compiler) {
  if (!program.copies_globals) return {};
  return CopyCollector(project, plan, program, compiler).collect(instance_in_c(resource, program, compiler));
}

}  // namespace plchost::iec
