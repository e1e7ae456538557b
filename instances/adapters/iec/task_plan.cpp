#include "instances/adapters/iec/task_plan.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "instances/adapters/iec/tokens.hpp"
#include "shm/base/names.hpp"

namespace plchost::iec {

namespace {

constexpr int kLowestPriority = 31;
constexpr int kLastRealTimePriority = 15;
constexpr std::int64_t kMicrosecond = 1'000;
constexpr std::ptrdiff_t kMostUsers = 14;  // PLC_MAX_AREA_USES
constexpr std::int64_t kMillisecond = 1'000'000;

// Task_Info has the interval in an unsigned int, in milliseconds if they are whole ones, else in
// microseconds.
bool is_interval(std::int64_t ns) noexcept {
  const std::int64_t unit = ns % kMillisecond == 0 ? kMillisecond : kMicrosecond;
  return ns % kMicrosecond == 0 && ns / unit <= std::numeric_limits<unsigned int>::max();
}

std::string_view kind_of(const Pou& pou) noexcept {
  return pou.kind == Pou::Kind::function_block ? "FUNCTION_BLOCK" : "FUNCTION";
}

class Planner {
 public:
  Planner(const Project& project, const Configuration& configuration, const Resource& resource,
          Compiler compiler)
      : project_(project), configuration_(configuration), resource_(resource), compiler_(compiler) {
    for (const auto* const globals : {&configuration.globals, &resource.globals}) {
      for (const Variable& variable : *globals) plan_.globals[folded(variable.name)] = &variable;
    }
    for (const Program& program : resource.programs) {
      if (!program.task.empty()) programs_[folded(program.task)].push_back(&program);
    }
    is_first_ = &resource == configuration.resources.data();
    plan_.locations = Locations(project, configuration);
  }

  TaskPlan plan() {
    if (is_first_) check_declared();
    find_located();
    for (const Task& task : resource_.tasks) add(task);
    for (const Program& program : resource_.programs) {
      if (program.connected) refuse_connection(program);
      if (program.task.empty()) add_freewheeling(program);
    }
    for (PlannedTask& task : plan_.tasks) find_uses(task);
    for (const PlannedTask& task : plan_.tasks) check(task);
    for (const PlannedTask& task : plan_.tasks) {
      if (!task.single.empty()) check_single(task);
    }
    check_areas();
    if (compiler_ == Compiler::matiec) {
      check_period();
      check_names();
    } else {
      check_instances();
    }
    name_shared_globals();
    name_shared_places();
    name_separate_globals();
    name_retained();
    if (plan_.tasks.empty() && plan_.problems.empty()) {
      plan_.problems.push_back({resource_.place, "no program runs here: it needs PROGRAM ... WITH a TASK"});
    }
    return std::move(plan_);
  }

 private:
  void add(const Task& task) {
    PlannedTask planned{.name = task.name,
                        .priority = task.priority,
                        .interval_ns = task.interval_ns.value_or(0),
                        .single = task.single,
                        .programs = {},
                        .places = {},
                        .globals = {},
                        .place = task.place,
                        .extension = task.extension};
    if (task.single.empty() && !task.interval_ns && task.extension.external_event.empty()) {
      return plan_.problems.push_back(
          {task.place, fmt::format("TASK {} has neither INTERVAL nor SINGLE, and no task file gives it an "
                                   "external_event, so it never runs",
                                   task.name)});
    }
    if (const auto found = programs_.find(folded(task.name)); found != programs_.end())
      planned.programs = found->second;
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
  void add_freewheeling(const Program& program) {
    plan_.tasks.push_back({.name = program.name,
                           .priority = kLowestPriority,
                           .interval_ns = 0,
                           .single = "",
                           .programs = {&program},
                           .places = {},
                           .globals = {},
                           .place = program.place,
                           .extension = program.extension});
    const std::string& event = program.extension.external_event;
    const std::string runs =
        event.empty() ? "it runs freewheeling" : "the external event " + event + " runs it";
    plan_.remarks.push_back({program.place, fmt::format("PROGRAM {} has no TASK: {}, with priority {}",
                                                        program.name, runs, kLowestPriority)});
  }
  [[nodiscard]] std::string_view compiler() const {
    return compiler_ == Compiler::matiec ? "iec2c" : "STruC++";
  }
  void refuse_connection(const Program& program) {
    plan_.problems.push_back(
        {program.place, fmt::format("PROGRAM {}: {} cannot translate connections in parentheses; "
                                    "use VAR_EXTERNAL in {}",
                                    program.name, compiler(), program.type)});
  }

  // Of the whole project, as iec2c translates also what no task runs. Each of its resources finds the same.
  void find_located() {
    for (const Pou& pou : project_.pous) {
      for (const Variable& variable : pou.variables) add_located(variable, &pou);
    }
    for (const Variable& variable : configuration_.globals) add_located(variable, nullptr);
    for (const Resource& resource : configuration_.resources) {
      for (const Variable& variable : resource.globals) add_located(variable, nullptr);
    }
    if (is_first_) plan_.remarks = plan_.locations.remarks();
  }
  void add_located(const Variable& variable, const Pou* pou) {
    if (variable.location.empty()) return;
    const auto place = plan_.locations.place(variable.location);
    if (place) plan_.located[*place].push_back(&variable);
    if (!is_first_) return;
    const auto wrong = [&](std::string text) { plan_.problems.push_back({variable.place, std::move(text)}); };
    if (pou != nullptr && pou->kind != Pou::Kind::program)
      return wrong(
          fmt::format("{} at {} in a {}: {} allows located variables only in a PROGRAM and in "
                      "VAR_GLOBAL",
                      variable.name, variable.location, kind_of(*pou), compiler()));
    if (!place) return wrong(place.error());
    const std::string type = folded(variable.type);
    if (bytes_of_type(type) == 0)
      return wrong(
          fmt::format("{} at {} is of type {}: only BOOL, integers, bit strings, REAL and LREAL "
                      "can be located; write one of these types itself",
                      variable.name, variable.location, variable.type));
    if (bytes_of_type(type) != place->bytes || (place->bit >= 0) != (type == "BOOL"))
      return wrong(fmt::format("{} does not fit into {}", variable.type, variable.location));
    if (compiler_ != Compiler::matiec) return;
    // They have one value in C.
    const auto [other, is_new] = types_.try_emplace(*place, type);
    if (!is_new && other->second != type)
      wrong(fmt::format("{} is {} here and {} elsewhere: give the variables of one location one type",
                        variable.location, variable.type, other->second));
  }

  void find_uses(PlannedTask& task) {
    for (const Program* const program : task.programs) {
      const auto [uses, is_new] = uses_.try_emplace(folded(program->type));
      if (is_new) uses->second = uses_of(program->type);
      task.places.insert(uses->second.places.begin(), uses->second.places.end());
      task.globals.insert(uses->second.globals.begin(), uses->second.globals.end());
    }
  }
  struct Uses {
    std::set<Place> places;
    std::set<std::string> globals;
  };
  // Of a program and of the function blocks in it.
  Uses uses_of(const std::string& program) {
    Uses uses;
    std::set<const Pou*> seen;
    std::vector<const Pou*> open;
    const auto visit = [&](std::string_view type) {
      const Pou* const pou = project_.pou(type);
      if (pou != nullptr && seen.insert(pou).second) open.push_back(pou);
    };
    visit(program);
    while (!open.empty()) {
      const Pou* const pou = open.back();
      open.pop_back();
      for (const Variable& variable : pou->variables) {
        if (variable.section == Variable::Section::external) {
          use_global(folded(variable.name), uses);
        } else {
          use_place(variable, uses);
        }
        visit(std::string_view(variable.type).substr(variable.type.rfind(' ') + 1));
      }
    }
    return uses;
  }
  void use_global(const std::string& name, Uses& uses) const {
    const auto global = plan_.globals.find(name);
    if (global == plan_.globals.end()) return;
    uses.globals.insert(name);
    use_place(*global->second, uses);
  }
  void use_place(const Variable& variable, Uses& uses) const {
    if (variable.location.empty()) return;
    if (const auto place = plan_.locations.place(variable.location)) uses.places.insert(*place);
  }

  void check(const PlannedTask& task) {
    const auto wrong = [&](std::string text) { plan_.problems.push_back({task.place, std::move(text)}); };
    if (task.name.size() > kMaxTaskName) {
      wrong(fmt::format("task '{}' has more than {} characters", task.name, kMaxTaskName));
    }
    if (!is_interval(task.interval_ns)) {
      wrong(
          fmt::format("INTERVAL of {}: allowed are whole microseconds up to 71 minutes, and whole "
                      "milliseconds up to 49 days",
                      task.name));
    }
  }
  // iec2c needs a tick, though no task of plchost runs by it.
  void check_period() {
    if (!is_first_) return;
    const bool has_period = std::ranges::any_of(configuration_.resources, [](const Resource& resource) {
      return std::ranges::any_of(resource.tasks,
                                 [](const Task& task) { return task.interval_ns.has_value(); });
    });
    if (has_period) return;
    plan_.problems.push_back(
        {resource_.place,
         "no TASK of this CONFIGURATION has an INTERVAL, and iec2c needs one: add a TASK "
         "with an INTERVAL; it may be one that runs no program"});
  }
  void check_areas() {
    constexpr std::array<std::pair<char, std::string_view>, 2> kImages{{{'I', "inputs"}, {'Q', "outputs"}}};
    for (const auto& [letter, name] : kImages) {
      const auto users = std::ranges::count_if(plan_.tasks, [&](const PlannedTask& task) {
        return std::ranges::any_of(task.places, [&](const Place& place) { return place.area == letter; });
      });
      if (users <= kMostUsers) continue;
      plan_.problems.push_back(
          {resource_.place,
           fmt::format("{} tasks use {} (%{}), at most {} can: run several programs in one task", users, name,
                       letter, kMostUsers)});
    }
  }
  // iec2c ends without a place for two types of one name, and STruC++ takes one of them without a word.
  void check_declared() {
    std::map<std::string, const char*> kinds;
    const auto take = [&](const std::string& name, const SourcePlace& place, const char* kind) {
      const auto [entry, is_new] = kinds.try_emplace(folded(name), kind);
      if (is_new || name.empty() || place.file.empty()) return;
      plan_.problems.push_back({place, fmt::format("'{}' is the name of {}, too: call one of them otherwise",
                                                   name, entry->second)});
    };
    for (const DeclaredType& type : project_.types) take(type.name, type.place, "a TYPE");
    for (const Pou& pou : project_.pous) take(pou.name, pou.place, "a POU");
  }

  // In the C of iec2c tasks, instances of programs, POUs and types have their names as they are, in upper
  // case.
  void check_names() {
    std::map<std::string, std::string> taken;
    for (const Pou& pou : project_.pous) taken[folded(pou.name)] = "a POU";
    for (const DeclaredType& type : project_.types) taken[folded(type.name)] = "a TYPE";
    const auto take = [&](const std::string& name, const SourcePlace& place, const char* what) {
      const auto [entry, is_new] = taken.try_emplace(folded(name), what);
      if (is_new) return;
      plan_.problems.push_back(
          {place, fmt::format(
                      "'{}' is the name of {}, too: iec2c cannot tell them apart; call one of them otherwise",
                      name, entry->second)});
    };
    for (const Task& task : resource_.tasks) take(task.name, task.place, "a TASK");
    for (const Program& program : resource_.programs) {
      take(program.name, program.place, "an instance of a PROGRAM");
    }
  }

  // In the C++ of STruC++ the instances of all resources are members of one class.
  void check_instances() {
    if (!is_first_) return;
    std::set<std::string> taken;
    for (const Resource& resource : configuration_.resources) {
      for (const Program& program : resource.programs) {
        if (taken.insert(folded(program.name)).second) continue;
        plan_.problems.push_back(
            {program.place, fmt::format("PROGRAM {}: STruC++ wants another name for each instance of the "
                                        "CONFIGURATION, and there is one of this name",
                                        program.name)});
      }
    }
  }

  // Its value must come from somewhere, also while the task waits for it.
  void check_single(const PlannedTask& task) {
    const auto global = plan_.globals.find(folded(task.single));
    if (global == plan_.globals.end() || folded(global->second->type) != "BOOL") {
      plan_.problems.push_back(
          {task.place, fmt::format("SINGLE of {}: '{}' is no BOOL of a VAR_GLOBAL", task.name, task.single)});
      return;
    }
    const std::string& location = global->second->location;
    const auto place = plan_.locations.place(location);
    // The memory area is read where it lies.
    if (!place || place->area == 'M') return;
    // With iec2c all variables of a place are one, but an input of a program has a value for each task.
    const bool is_one = compiler_ == Compiler::matiec && place->area != 'I';
    const bool is_used = std::ranges::any_of(plan_.tasks, [&](const PlannedTask& other) {
      return runs_by_itself(other) &&
             (is_one ? other.places.contains(*place) : other.globals.contains(folded(task.single)));
    });
    if (is_used) return;
    PlannedTask* const reader = place->area == 'I' ? quickest() : nullptr;
    const std::string variable = fmt::format("{} at {}", task.single, location);
    if (reader == nullptr) {
      const std::string why =
          place->area == 'I'
              ? fmt::format("no task reads {}; add a TASK with an INTERVAL and a program", variable)
              : fmt::format("no cyclic program writes {}; name it in the VAR_EXTERNAL of one", variable);
      plan_.problems.push_back(
          {task.place, fmt::format("SINGLE of {} would see no edge: {}", task.name, why)});
      return;
    }
    reader->places.insert(*place);
    reader->globals.insert(folded(task.single));
    plan_.remarks.push_back(
        {task.place,
         fmt::format("SINGLE of {}: the task {} reads {}, as no cyclic program has it in VAR_EXTERNAL",
                     task.name, reader->name, variable)});
  }
  [[nodiscard]] static bool runs_by_itself(const PlannedTask& task) {
    return task.single.empty() && task.extension.external_event.empty();
  }
  // The cyclic task with the shortest interval, else a freewheeling one. Null: there is none.
  [[nodiscard]] PlannedTask* quickest() {
    const auto rank = [](const PlannedTask& task) {
      return std::tuple(task.interval_ns == 0, task.interval_ns, task.priority);
    };
    PlannedTask* best = nullptr;
    for (PlannedTask& task : plan_.tasks) {
      if (runs_by_itself(task) && (best == nullptr || rank(task) < rank(*best))) best = &task;
    }
    return best;
  }

  using Tasks = std::vector<const PlannedTask*>;
  static std::string names_of(const Tasks& tasks) {
    std::vector<std::string_view> names;
    for (const PlannedTask* const task : tasks) names.emplace_back(task->name);
    return fmt::format("{}", fmt::join(names, ", "));
  }
  static bool can_interleave(const Tasks& tasks) {
    const auto [lowest, highest] = std::ranges::minmax(tasks, {}, &PlannedTask::priority);
    return lowest->priority != highest->priority ||
           (tasks.size() > 1 && lowest->priority > kLastRealTimePriority);
  }
  void name_shared_globals() {
    std::map<std::string, Tasks> users;
    for (const PlannedTask& task : plan_.tasks) {
      for (const std::string& name : task.globals) users[name].push_back(&task);
    }
    for (const auto& [name, tasks] : users) {
      const Variable& variable = *plan_.globals.at(name);
      if (variable.constant || !can_interleave(tasks) || !changes_in_a_cycle(name, tasks)) continue;
      name_shared(variable, tasks,
                  ". Set globals = \"copy\" in [program.NAME] of the task file to prevent that");
    }
  }
  // Of a task that another one can pre-empt, and of a program without a copy.
  bool changes_in_a_cycle(const std::string& global, const Tasks& tasks) {
    return std::ranges::any_of(tasks, [&](const PlannedTask* task) {
      return std::ranges::any_of(tasks,
                                 [&](const PlannedTask* other) { return can_pre_empt(*other, *task); }) &&
             std::ranges::any_of(task->programs, [&](const Program* program) {
               return !program->copies_globals && uses_.at(folded(program->type)).globals.contains(global);
             });
    });
  }
  static bool can_pre_empt(const PlannedTask& other, const PlannedTask& task) {
    return &other != &task && (other.priority < task.priority ||
                               std::min(other.priority, task.priority) > kLastRealTimePriority);
  }
  // Those of programs. An input of a program has a value for each task.
  void name_shared_places() {
    std::map<Place, Tasks> users;
    for (const PlannedTask& task : plan_.tasks) {
      for (const Place& place : task.places) users[place].push_back(&task);
    }
    for (const auto& [place, tasks] : users) {
      const Variable& variable = *plan_.located.at(place).back();  // a global, if there is one
      if (place.area == 'I' || variable.section == Variable::Section::global) continue;
      if (can_interleave(tasks)) name_shared(variable, tasks);
    }
  }
  void name_shared(const Variable& variable, const Tasks& tasks, std::string_view advice = "") {
    plan_.remarks.push_back(
        {variable.place, fmt::format("the tasks {} use {} and can pre-empt each other: it may "
                                     "change in the middle of a cycle{}",
                                     names_of(tasks), variable.name, advice)});
  }
  void name_separate_globals() {
    if (!is_first_ || configuration_.resources.size() < 2) return;
    std::vector<std::string_view> names;
    const Variable* first = nullptr;
    for (const Variable& variable : configuration_.globals) {
      if (variable.constant || !variable.location.empty()) continue;
      if (first == nullptr) first = &variable;
      names.push_back(variable.name);
    }
    if (first == nullptr) return;
    plan_.remarks.push_back(
        {first->place,
         fmt::format("each RESOURCE becomes an application with its own copy of {}: no resource "
                     "sees what another one writes",
                     fmt::join(names, ", "))});
  }

  void name_retained() {
    for (const auto& [place, variables] : plan_.located) {
      for (const Variable* const variable : variables) {
        if (!is_first_ || !variable->retain) continue;
        plan_.remarks.push_back(
            {variable->place,
             fmt::format("RETAIN of {} at {} is not carried out: its area keeps it or does not",
                         variable->name, variable->location)});
      }
    }
  }

  const Project& project_;
  const Configuration& configuration_;
  const Resource& resource_;
  Compiler compiler_;
  bool is_first_ = false;  // of the configuration: it says what is wrong outside of the resources
  std::map<std::string, std::vector<const Program*>> programs_;  // by the folded name of their task
  std::map<std::string, Uses> uses_;                             // by the folded name of a program's type
  std::map<Place, std::string> types_;
  TaskPlan plan_;
};

}  // namespace

TaskPlan plan_tasks(const Project& project, const Configuration& configuration, const Resource& resource,
                    Compiler compiler) {
  return Planner(project, configuration, resource, compiler).plan();
}

}  // namespace plchost::iec
