#include "instances/adapters/matiec/glue.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/matiec/task_plan.hpp"

namespace plchost::matiec {

namespace {

using iec::folded;

// As iec2c calls a resource that has no name.
std::string name_in_c(const iec::Resource& resource) {
  return resource.name.empty() ? "RESOURCE" : folded(resource.name);
}

class Writer {
 public:
  Writer(const iec::Configuration& configuration, const iec::Resource& resource, TaskPlan plan)
      : configuration_(configuration), resource_(resource), plan_(std::move(plan)) {}

  Glue write(const std::vector<Located>& located) {
    print("/* Written by plcctl build application. */\n#include \"plchost_matiec.h\"\n#include \"{}.c\"\n\n",
          resource_.name.empty() ? "RESOURCE" : resource_.name);
    print("BOOL __DEBUG;\nconst char plchost_application_name[] = \"{}\";\n", configuration_.name);
    write_other_resources();
    write_places(located);
    for (std::size_t i = 0; i < plan_.tasks.size(); ++i) write_task(plan_.tasks[i], i);
    write_tasks();
    return {std::move(text_), std::move(plan_.problems), std::move(plan_.remarks)};
  }

 private:
  template <class... Values>
  void print(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Values>(values)...);
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
    std::string table;
    for (const Located& variable : located) {
      const auto place = place_of(variable.location);
      const iec::SourcePlace where = place_in_source(variable);
      if (!place) {
        plan_.problems.push_back({where, place.error()});
        continue;
      }
      const unsigned bytes = bytes_of_type(variable.type);
      if (bytes != place->bytes || (place->bit >= 0) != (variable.type == "BOOL")) {
        plan_.problems.push_back(
            {where, fmt::format("{} does not fit into {}", variable.type, variable.location)});
        continue;
      }
      print("static {} plchost_value_{};\n{} *{} = &plchost_value_{};\n", variable.type, places_.size(),
            variable.type, variable.name, places_.size());
      table += fmt::format("  {{'{}', {}, {}, {}u, &plchost_value_{}}},\n", place->area, place->bytes,
                           place->bit, place->offset, places_.size());
      places_.push_back(*place);
    }
    print(
        "const unsigned int plchost_place_count = {};\nconst struct plchost_place plchost_places[] = {{\n{}  "
        "{{0}}}};\n",
        places_.size(), table);
  }
  [[nodiscard]] iec::SourcePlace place_in_source(const Located& located) const {
    const auto is_it = [&](const iec::Variable& variable) {
      return !variable.location.empty() && place_of(variable.location) == place_of(located.location);
    };
    for (const auto& [name, variable] : plan_.globals) {
      if (is_it(*variable)) return variable->place;
    }
    return configuration_.place;
  }

  void write_task(const PlannedTask& task, std::size_t number) {
    std::vector<std::size_t> uses;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const bool used = std::ranges::any_of(
          task.locations, [&](const std::string& location) { return place_of(location) == places_[i]; });
      if (used) uses.push_back(i);
    }
    print("static const unsigned int plchost_uses_{}[] = {{{}{}0}};\n", number, fmt::join(uses, ", "),
          uses.empty() ? "" : ", ");
    print("static unsigned long long plchost_at_begin_{}[{}];\n", number,
          std::max<std::size_t>(uses.size(), 1));
    print("static void plchost_run_{0}(void) {{\n  plchost_begin({0});\n", number);
    for (const iec::Program* const program : task.programs) {
      print("  {}_body__(&{}__{});\n", folded(program->type), name_in_c(resource_), folded(program->name));
    }
    print("  plchost_end({});\n}}\n", number);
    if (!task.single.empty()) {
      print("static unsigned char plchost_edge_{}(void) {{ return *__GET_GLOBAL_{}(); }}\n", number,
            folded(task.single));
    }
    use_counts_.push_back(uses.size());
    if (task.extension.options) write_options(*task.extension.options, number);
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
          "  {{\"{0}\", {1}, {2}L, {3}, plchost_run_{4}, {5}, plchost_uses_{4}, plchost_at_begin_{4}, {6}, "
          "{7}}},\n",
          task.name, task.priority, task.interval_ns,
          task.single.empty() ? "0" : fmt::format("plchost_edge_{}", i), i, use_counts_[i],
          event.empty() ? "0" : fmt::format("\"{}\"", event),
          task.extension.options ? fmt::format("&plchost_options_{}", i) : "0");
    }
    print("}};\n");
  }

  const iec::Configuration& configuration_;
  const iec::Resource& resource_;
  TaskPlan plan_;
  std::vector<Place> places_;
  std::vector<std::size_t> use_counts_;
  std::string text_;
};

}  // namespace

Glue write_glue(const iec::Project& project, const iec::Configuration& configuration,
                const iec::Resource& resource, const std::vector<Located>& located) {
  return Writer(configuration, resource, plan_tasks(project, configuration, resource)).write(located);
}

}  // namespace plchost::matiec
