#include "instances/adapters/matiec/task_plan.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "instances/adapters/iec/tokens.hpp"
#include "shm/base/names.hpp"

namespace plchost::matiec {

namespace {

using iec::folded;

constexpr int kLowestPriority = 31;
constexpr std::int64_t kMicrosecond = 1'000;
constexpr std::int64_t kMaxInterval = std::int64_t{50} * 24 * 3'600 * 1'000'000'000;

class Planner {
 public:
  Planner(const iec::Project& project, const iec::Configuration& configuration, const iec::Resource& resource)
      : project_(project), configuration_(configuration), resource_(resource) {
    for (const auto* const globals : {&configuration.globals, &resource.globals}) {
      for (const iec::Variable& variable : *globals) plan_.globals[folded(variable.name)] = &variable;
    }
  }

  TaskPlan plan() {
    for (const iec::Task& task : resource_.tasks) add(task);
    for (const iec::Program& program : resource_.programs) {
      if (program.connected) refuse_connection(program);
      if (program.task.empty()) add_freewheeling(program);
    }
    for (PlannedTask& task : plan_.tasks) find_uses(task);
    for (const PlannedTask& task : plan_.tasks) check(task);
    check_names();
    name_shared_globals();
    name_retained();
    if (plan_.tasks.empty() && plan_.problems.empty()) {
      plan_.problems.push_back({resource_.place, "no program runs here: it needs PROGRAM ... WITH a TASK"});
    }
    return std::move(plan_);
  }

 private:
  void add(const iec::Task& task) {
    PlannedTask planned{.name = task.name,
                        .priority = task.priority,
                        .interval_ns = task.interval_ns.value_or(0),
                        .single = task.single,
                        .programs = {},
                        .locations = {},
                        .globals = {},
                        .place = task.place,
                        .extension = task.extension};
    if (task.single.empty() && !task.interval_ns && task.extension.external_event.empty()) {
      return plan_.problems.push_back(
          {task.place, fmt::format("TASK {} has neither INTERVAL nor SINGLE, and no task file gives it an "
                                   "external_event, so it never runs",
                                   task.name)});
    }
    for (const iec::Program& program : resource_.programs) {
      if (folded(program.task) == folded(task.name)) planned.programs.push_back(&program);
    }
    if (planned.programs.empty()) {
      return plan_.remarks.push_back(
          {task.place, fmt::format("TASK {} runs no program, so it is left out", task.name)});
    }
    if (!task.extension.external_event.empty()) {
      run_by_event(planned);
    } else if (!task.single.empty() && task.interval_ns) {
      plan_.remarks.push_back(
          {task.place, fmt::format("TASK {} has SINGLE and INTERVAL: only the edge of {} runs it", task.name,
                                   task.single)});
      planned.interval_ns = 0;
    }
    plan_.tasks.push_back(std::move(planned));
  }
  void run_by_event(PlannedTask& task) {
    const std::string_view other = !task.single.empty() ? "SINGLE" : task.interval_ns != 0 ? "INTERVAL" : "";
    if (!other.empty()) {
      plan_.remarks.push_back({task.place, fmt::format("TASK {}: the external event {} runs it, so its {} "
                                                       "is not used",
                                                       task.name, task.extension.external_event, other)});
    }
    task.interval_ns = 0;
    task.single.clear();
  }
  void add_freewheeling(const iec::Program& program) {
    plan_.tasks.push_back({.name = program.name,
                           .priority = kLowestPriority,
                           .interval_ns = 0,
                           .single = "",
                           .programs = {&program},
                           .locations = {},
                           .globals = {},
                           .place = program.place,
                           .extension = program.extension});
    const std::string& event = program.extension.external_event;
    const std::string runs =
        event.empty() ? "it runs freewheeling" : "the external event " + event + " runs it";
    plan_.remarks.push_back({program.place, fmt::format("PROGRAM {} has no TASK: {}, with priority {}",
                                                        program.name, runs, kLowestPriority)});
  }
  void refuse_connection(const iec::Program& program) {
    plan_.problems.push_back(
        {program.place, fmt::format("PROGRAM {}: iec2c cannot translate connections in parentheses; "
                                    "use VAR_EXTERNAL in {}",
                                    program.name, program.type)});
  }

  void find_uses(PlannedTask& task) {
    std::set<std::string> seen;
    for (const iec::Program* const program : task.programs) find_uses(task, program->type, seen);
  }
  // Of a POU and of the function blocks in it.
  void find_uses(PlannedTask& task, const std::string& type, std::set<std::string>& seen) {
    const iec::Pou* const pou = project_.pou(type);
    if (pou == nullptr || !seen.insert(folded(type)).second) return;
    for (const iec::Variable& variable : pou->variables) {
      if (!variable.location.empty()) task.locations.insert(variable.location);
      if (variable.section == iec::Variable::Section::external) {
        const auto global = plan_.globals.find(folded(variable.name));
        if (global == plan_.globals.end()) continue;
        task.globals.insert(global->first);
        if (!global->second->location.empty()) task.locations.insert(global->second->location);
      }
      find_uses(task, variable.type.substr(variable.type.rfind(' ') + 1), seen);
    }
  }

  void check(const PlannedTask& task) {
    const auto wrong = [&](std::string text) { plan_.problems.push_back({task.place, std::move(text)}); };
    if (task.name.size() > kMaxTaskName) {
      wrong(fmt::format("task '{}' has more than {} characters", task.name, kMaxTaskName));
    }
    if (task.interval_ns % kMicrosecond != 0 || task.interval_ns > kMaxInterval) {
      wrong(fmt::format("INTERVAL of {}: allowed are whole microseconds up to 50 days", task.name));
    }
    if (!task.single.empty()) check_single(task);
  }
  // In the C of iec2c tasks, instances of programs, POUs and types have their names as they are, in upper
  // case.
  void check_names() {
    std::map<std::string, std::string> taken;
    for (const iec::Pou& pou : project_.pous) taken[folded(pou.name)] = "a POU";
    for (const iec::DeclaredType& type : project_.types) taken[folded(type.name)] = "a TYPE";
    const auto take = [&](const std::string& name, const iec::SourcePlace& place, const char* what) {
      const auto [entry, is_new] = taken.try_emplace(folded(name), what);
      if (is_new) return;
      plan_.problems.push_back(
          {place, fmt::format(
                      "'{}' is the name of {}, too: iec2c cannot tell them apart; call one of them otherwise",
                      name, entry->second)});
    };
    for (const iec::Task& task : resource_.tasks) take(task.name, task.place, "a TASK");
    for (const iec::Program& program : resource_.programs) {
      take(program.name, program.place, "an instance of a PROGRAM");
    }
  }

  // Its value must come from somewhere, also while the task waits for it.
  void check_single(const PlannedTask& task) {
    const auto global = plan_.globals.find(folded(task.single));
    if (global == plan_.globals.end() || global->second->type != "BOOL") {
      plan_.problems.push_back(
          {task.place, fmt::format("SINGLE of {}: '{}' is no BOOL of a VAR_GLOBAL", task.name, task.single)});
      return;
    }
    const std::string& location = global->second->location;
    if (location.empty()) return;
    const bool is_read = std::ranges::any_of(plan_.tasks, [&](const PlannedTask& other) {
      return other.single.empty() && other.extension.external_event.empty() &&
             other.locations.contains(location);
    });
    if (is_read) return;
    plan_.problems.push_back(
        {task.place,
         fmt::format("SINGLE of {}: no other task reads {} at {}, so nobody would see its edge; name it in "
                     "the VAR_EXTERNAL of a cyclic program",
                     task.name, task.single, location)});
  }

  void name_shared_globals() {
    for (const auto& [name, variable] : plan_.globals) {
      if (variable->constant) continue;
      std::vector<std::string> users;
      std::set<int> priorities;
      for (const PlannedTask& task : plan_.tasks) {
        if (!task.globals.contains(name)) continue;
        users.push_back(task.name);
        priorities.insert(task.priority);
      }
      if (priorities.size() < 2) continue;
      plan_.remarks.push_back(
          {variable->place, fmt::format("the tasks {} use {} and can pre-empt each other: it may "
                                        "change in the middle of a cycle",
                                        fmt::join(users, ", "), variable->name)});
    }
  }

  void name_retained() {
    const auto name = [&](const std::string& where, const std::vector<iec::Variable>& variables) {
      std::vector<std::string> names;
      for (const iec::Variable& variable : variables) {
        if (variable.retain) names.push_back(variable.name);
      }
      if (names.empty()) return;
      const auto first = std::ranges::find_if(variables, &iec::Variable::retain);
      plan_.remarks.push_back(
          {first->place, fmt::format("RETAIN of {} in {} is not carried out: they begin with their "
                                     "initial values at each start",
                                     fmt::join(names, ", "), where)});
    };
    for (const iec::Pou& pou : project_.pous) name(pou.name, pou.variables);
    name(configuration_.name, configuration_.globals);
    name(resource_.name, resource_.globals);
  }

  const iec::Project& project_;
  const iec::Configuration& configuration_;
  const iec::Resource& resource_;
  TaskPlan plan_;
};

}  // namespace

TaskPlan plan_tasks(const iec::Project& project, const iec::Configuration& configuration,
                    const iec::Resource& resource) {
  return Planner(project, configuration, resource).plan();
}

}  // namespace plchost::matiec
