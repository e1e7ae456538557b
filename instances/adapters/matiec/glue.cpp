#include "instances/adapters/matiec/glue.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/matiec/task_plan.hpp"
#include "instances/adapters/matiec/variables.hpp"

namespace plchost::matiec {

namespace {

using iec::folded;

// As iec2c calls a resource that has no name.
std::string name_in_c(const iec::Resource& resource) {
  return resource.name.empty() ? "RESOURCE" : folded(resource.name);
}

std::string list_of(const std::vector<std::size_t>& numbers) {
  return fmt::format("{}{}0", fmt::join(numbers, ", "), numbers.empty() ? "" : ", ");
}

class Writer {
 public:
  Writer(const iec::Project& project, const iec::Configuration& configuration, const iec::Resource& resource)
      : project_(project),
        configuration_(configuration),
        resource_(resource),
        plan_(plan_tasks(project, configuration, resource)),
        variables_(variables_of(project, resource, plan_)) {
    std::ranges::copy(variables_.remarks, std::back_inserter(plan_.remarks));
    number_retained();
  }

  Glue write(const std::vector<Located>& located) {
    print("/* Written by plcctl build application. */\n#include \"plchost_matiec.h\"\n#include \"{}.c\"\n\n",
          resource_.name.empty() ? "RESOURCE" : resource_.name);
    print("BOOL __DEBUG;\nconst char plchost_application_name[] = \"{}\";\n", configuration_.name);
    forget_macros();
    write_other_resources();
    write_places(located);
    refuse_shared_bits();
    for (std::size_t i = 0; i < plan_.tasks.size(); ++i) write_task(plan_.tasks[i], i);
    write_tasks();
    write_variables();
    print("void plchost_bind(void) {{\n{}}}\n", bindings_);
    return {std::move(text_), std::move(plan_.problems), std::move(plan_.remarks)};
  }

 private:
  /// A place that iec2c has a pointer for.
  struct Known {
    Located located;
    Place place;
    bool aliased = false;
    std::set<std::size_t> tasks{};  // that use it
  };

  template <class... Values>
  void print(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Values>(values)...);
  }

  // The file of the resource has a macro for each instance.
  void forget_macros() {
    for (const iec::Program& program : resource_.programs) print("#undef {}\n", folded(program.name));
  }
  // The file of the configuration calls all of them. Each is an application of its own.
  void write_other_resources() {
    for (const iec::Resource& other : configuration_.resources) {
      if (&other == &resource_) continue;
      print("void {0}_init__(void) {{}}\nvoid {0}_run__(unsigned long tick) {{ (void)tick; }}\n",
            name_in_c(other));
    }
  }

  void write_places(const std::vector<Located>& located) {
    find_places(located);
    find_aliases();
    std::string table;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const Located& pointer = places_[i].located;
      const Place& place = places_[i].place;
      print("static {} plchost_value_{};\n{} *{} = &plchost_value_{};\n", pointer.type, i, pointer.type,
            pointer.name, i);
      table += fmt::format("  {{\"{}\", '{}', {}, {}, {}, {}u, &plchost_value_{}}},\n", pointer.name,
                           place.area, place.bytes, place.bit, places_[i].aliased ? 1 : 0, place.offset, i);
    }
    print(
        "const unsigned int plchost_place_count = {};\nconst struct plchost_place plchost_places[] = {{\n{}  "
        "{{0}}}};\nunsigned long long plchost_exchanged[{}];\n",
        places_.size(), table, places_.size() + 1);
  }
  // Of the same name once: several programs may have it.
  void find_places(const std::vector<Located>& located) {
    for (const Located& pointer : located) {
      const auto place = place_of(pointer.location);
      if (!place || !plan_.located.contains(*place)) {
        const auto written = project_.locations.find(pointer.location);
        plan_.problems.push_back(
            {written == project_.locations.end() ? configuration_.place : written->second,
             fmt::format("{}: the declaration around it is not understood", pointer.location)});
      } else if (numbers_.try_emplace(*place, places_.size()).second) {
        places_.push_back({.located = pointer, .place = *place});
      }
    }
    for (std::size_t i = 0; i < plan_.tasks.size(); ++i) {
      for (const Place& place : plan_.tasks[i].places) {
        if (const auto number = numbers_.find(place); number != numbers_.end())
          places_[number->second].tasks.insert(i);
      }
    }
  }

  static unsigned first_bit(const Place& place) {
    return place.offset * 8 + static_cast<unsigned>(std::max(place.bit, 0));
  }
  static unsigned end_bit(const Place& place) {
    return place.bit < 0 ? (place.offset + place.bytes) * 8 : first_bit(place) + 1;
  }
  // In the order of their begins. One that begins before the others have ended shares bits.
  void find_aliases() {
    std::vector<std::size_t> order(places_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, {}, [&](std::size_t number) {
      return std::pair(places_[number].place.area, first_bit(places_[number].place));
    });
    unsigned end = 0;
    for (const std::size_t number : order) {
      const Place& place = places_[number].place;
      const bool is_apart = groups_.empty() || places_[groups_.back().front()].place.area != place.area ||
                            first_bit(place) >= end;
      if (is_apart) groups_.emplace_back();
      groups_.back().push_back(number);
      end = is_apart ? end_bit(place) : std::max(end, end_bit(place));
    }
    std::erase_if(groups_, [](const auto& group) { return group.size() < 2; });
    for (const auto& group : groups_) {
      for (const std::size_t number : group) places_[number].aliased = true;
    }
  }
  // A task has its own copy of the outputs, so one of the two would undo what the other one wrote.
  void refuse_shared_bits() {
    for (const auto& group : groups_) {
      std::set<std::size_t> tasks;
      for (const std::size_t number : group)
        tasks.insert(places_[number].tasks.begin(), places_[number].tasks.end());
      if (places_[group.front()].place.area != 'Q' || tasks.size() < 2) continue;
      std::vector<std::string_view> names;
      for (const std::size_t task : tasks) names.emplace_back(plan_.tasks[task].name);
      plan_.problems.push_back(
          {plan_.located.at(places_[group.back()].place).front()->place,
           fmt::format("{} and {} share bits, and the tasks {} use them: use both in one task",
                       places_[group.back()].located.location, places_[group.front()].located.location,
                       fmt::join(names, ", "))});
    }
  }

  void write_task(const PlannedTask& task, std::size_t number) {
    const std::size_t uses = write_uses(task, number);
    print("static const unsigned int plchost_retained_{}[] = {{{}}};\n", number,
          list_of(retained_by(number)));
    print("static void plchost_run_{0}(void) {{\n  plchost_begin({0});\n", number);
    for (const iec::Program* const program : task.programs) {
      print("  {}_body__(&{}__{});\n", folded(program->type), name_in_c(resource_), folded(program->name));
    }
    print("  plchost_end({});\n}}\n", number);
    if (!task.single.empty()) write_edge(task, number);
    if (task.extension.options) write_options(*task.extension.options, number);
    use_counts_.push_back(uses);
  }

  void write_edge(const PlannedTask& task, std::size_t number) {
    const auto global = plan_.globals.find(folded(task.single));
    const auto place =
        global == plan_.globals.end() ? numbers_.end() : numbers_.find(place_or_none(*global->second));
    print("static unsigned char plchost_edge_{}(void) {{ return ", number);
    if (place != numbers_.end() && place->first.area == 'M') {
      print("plchost_bit_now({}); }}\n", place->second);
    } else {
      print("*__GET_GLOBAL_{}(); }}\n", folded(task.single));
    }
  }
  static Place place_or_none(const iec::Variable& variable) {
    return place_of(variable.location).value_or(Place{.area = ' '});
  }

  // The number of them.
  std::size_t write_uses(const PlannedTask& task, std::size_t number) {
    std::string uses;
    std::size_t count = 0;
    const auto add = [&](std::size_t place, const std::string& value) {
      const bool is_of_others = !places_[place].tasks.contains(number);
      uses += fmt::format("  {{{}, &{}, {}, 0}},\n", place, value, is_of_others ? 1 : 0);
      ++count;
    };
    const std::set<Place> own = own_inputs(task, number, add);
    for (const std::size_t place : exchanged_by(task)) {
      if (!own.contains(places_[place].place)) add(place, fmt::format("plchost_value_{}", place));
    }
    print("static struct plchost_use plchost_uses_{}[] = {{\n{}  {{0}}}};\n", number, uses);
    return count;
  }
  // Inputs of programs that several tasks use: no other task changes them in the middle of a cycle.
  std::set<Place> own_inputs(const PlannedTask& task, std::size_t number, const auto& add) {
    std::set<Place> own;
    std::set<Place> shared;
    for (const std::string& name : task.globals) shared.insert(place_or_none(*plan_.globals.at(name)));
    for (const iec::Program* const program : task.programs) {
      std::string pointers;
      const iec::Pou* const type = project_.pou(program->type);
      if (type == nullptr) continue;
      for (const iec::Variable& variable : type->variables) {
        const Place place = place_or_none(variable);
        const auto known = numbers_.find(place);
        if (place.area != 'I' || known == numbers_.end() || places_[known->second].tasks.size() < 2) continue;
        const Located& located = places_[known->second].located;
        const std::string value = fmt::format("plchost_input_{}_{}", number, known->second);
        pointers += fmt::format("  {} = &{};\n", located.name, value);
        if (!own.insert(place).second) continue;
        print("static {} {};\n", located.type, value);
        add(known->second, value);
      }
      if (pointers.empty()) continue;
      bindings_ += fmt::format("{}  {}_init__(&{}__{}, 0);\n", pointers, folded(program->type),
                               name_in_c(resource_), folded(program->name));
    }
    std::erase_if(own, [&](const Place& place) { return shared.contains(place); });
    return own;
  }
  // Those that its programs use, and the other outputs in the same bytes: a byte of the outputs is that of
  // the task that has changed it last.
  [[nodiscard]] std::vector<std::size_t> exchanged_by(const PlannedTask& task) const {
    std::set<unsigned> bytes;
    for (const Place& place : task.places) {
      for (unsigned i = 0; place.area == 'Q' && i < place.bytes; ++i) bytes.insert(place.offset + i);
    }
    std::vector<std::size_t> result;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const Known& known = places_[i];
      const bool beside = known.place.area == 'Q' && known.place.bit >= 0 && !known.aliased &&
                          !known.tasks.empty() && bytes.contains(known.place.offset);
      if (beside || task.places.contains(known.place)) result.push_back(i);
    }
    return result;
  }

  // Their numbers among the retained ones.
  void number_retained() {
    std::size_t next = 0;
    for (const ProgramVariable& variable : variables_.all) {
      retained_number_.push_back(next);
      if (variable.retain) ++next;
    }
  }
  [[nodiscard]] std::vector<std::size_t> retained_by(std::size_t task) const {
    std::vector<std::size_t> result;
    for (const std::size_t variable : variables_.retained[task]) result.push_back(retained_number_[variable]);
    return result;
  }
  void write_options(const TaskOptions& options, std::size_t number) {
    using std::chrono::microseconds;
    const TaskWatchdog& watchdog = options.watchdog;
    print("static const struct plchost_options plchost_options_{} = {{{}L, {}, {}, {}u, {}u, {}u, {}}};\n",
          number, options.start_offset.count(), std::to_underlying(options.late),
          options.drives_outputs ? 1 : 0, watchdog.time / microseconds(1), watchdog.sensitivity,
          watchdog.omitted_cycles, std::to_underlying(watchdog.policy));
  }

  void write_tasks() {
    print("const unsigned int plchost_task_count = {};\nconst struct plchost_task plchost_tasks[] = {{\n",
          plan_.tasks.size());
    for (std::size_t i = 0; i < plan_.tasks.size(); ++i) {
      const PlannedTask& task = plan_.tasks[i];
      const std::string& event = task.extension.external_event;
      print(
          "  {{\"{0}\", {1}, {2}L, {3}, plchost_run_{4}, {5}, plchost_uses_{4}, {6}, "
          "plchost_retained_{4}, {7}, {8}}},\n",
          task.name, task.priority, task.interval_ns,
          task.single.empty() ? "0" : fmt::format("plchost_edge_{}", i), i, use_counts_[i],
          variables_.retained[i].size(), event.empty() ? "0" : fmt::format("\"{}\"", event),
          task.extension.options ? fmt::format("&plchost_options_{}", i) : "0");
    }
    print("}};\n");
  }

  void write_variables() {
    print(
        "void plchost_each_variable(void (*use)(const struct plchost_variable*)) {{\n"
        "  struct plchost_variable v;\n  (void)use;\n  (void)v;\n");
    for (const ProgramVariable& variable : variables_.all) {
      print(
          "  v.path = \"{0}\"; v.value = &{1}; v.bytes = sizeof {1}; v.layout = {2}ull; v.retain = {3}; "
          "use(&v);\n",
          variable.path, variable.value, variable.layout, variable.retain ? 1 : 0);
    }
    print("}}\n");
  }

  const iec::Project& project_;
  const iec::Configuration& configuration_;
  const iec::Resource& resource_;
  TaskPlan plan_;
  ProgramVariables variables_;
  std::vector<Known> places_;
  std::map<Place, std::size_t> numbers_;          // of places_
  std::vector<std::vector<std::size_t>> groups_;  // of places that share bits
  std::vector<std::size_t> use_counts_;
  std::vector<std::size_t> retained_number_;  // for each variable, if it is retained
  std::string bindings_;
  std::string text_;
};

}  // namespace

Glue write_glue(const iec::Project& project, const iec::Configuration& configuration,
                const iec::Resource& resource, const std::vector<Located>& located) {
  return Writer(project, configuration, resource).write(located);
}

}  // namespace plchost::matiec
