#include "instances/adapters/iec/glue.hpp"

#include <algorithm>
#include <chrono>
#include <numeric>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "instances/adapters/iec/locations.hpp"
#include "instances/adapters/iec/tokens.hpp"
#include "shm/variables/variable_symbol.hpp"

namespace plchost::iec {

namespace {

std::string list_of(const std::vector<std::size_t>& numbers) {
  return fmt::format("{}{}0", fmt::join(numbers, ", "), numbers.empty() ? "" : ", ");
}

}  // namespace

GlueWriter::GlueWriter(const Project& project, const Configuration& configuration, const Resource& resource,
                       Compiler compiler)
    : project_(project),
      configuration_(configuration),
      resource_(resource),
      compiler_(compiler),
      plan_(plan_tasks(project, configuration, resource, compiler)),
      variables_(variables_of(project, resource, plan_, compiler)) {
  std::ranges::copy(variables_.remarks, std::back_inserter(plan_.remarks));
  number_retained();
  find_copies();
}

Glue GlueWriter::write() {
  find_places();
  find_aliases();
  find_rings();
  write_head();
  print("const char plchost_application_name[] = \"{}\";\nconst char plchost_scheduler[] = \"{}\";\n",
        configuration_.name, resource_.scheduler);
  write_storage();
  write_copies();
  write_places();
  write_locations();
  refuse_shared_bits();
  name_shared_memory();
  for (std::size_t i = 0; i < plan_.tasks.size(); ++i) write_task(plan_.tasks[i], i);
  write_tasks();
  write_programs();
  write_variables();
  write_symbols();
  write_binding();
  return {std::move(text_), std::move(plan_.problems), std::move(plan_.remarks)};
}

void GlueWriter::find_copies() {
  for (const PlannedTask& task : plan_.tasks) {
    for (const Program* const program : task.programs) {
      ProgramCopies copies = copies_of(project_, resource_, plan_, *program, compiler_);
      std::ranges::move(copies.remarks, std::back_inserter(plan_.remarks));
      if (copies.all.empty()) continue;
      copies_of_programs_[program] = {.first = copies_.size(), .count = copies.all.size()};
      std::ranges::move(copies.all, std::back_inserter(copies_));
    }
  }
}

void GlueWriter::write_copies() {
  if (copies_.empty()) return;
  std::string rows;
  for (std::size_t i = 0; i < copies_.size(); ++i) {
    const CopyText text = copy(copies_[i], i);
    print("{}\n", text.storage);
    rows += fmt::format("  {{0, &{0}, &plchost_before_{1}, sizeof {0}, sizeof {2}, {3}}},\n", text.value, i,
                        text.piece, text.locked);
  }
  print("static struct plchost_copy plchost_copies[] = {{\n{}}};\n", rows);
}

void GlueWriter::write_copy_bindings() {
  for (std::size_t i = 0; i < copies_.size(); ++i) {
    const CopyText text = copy(copies_[i], i);
    print("  plchost_copies[{}].global = {};\n", i, text.global);
    for (const std::string& external : copies_[i].externals)
      print("  {}{} = &plchost_copy_{};\n", external, text.external_end, i);
  }
}

void GlueWriter::write_call(const Program& program) {
  const auto copies = copies_of_programs_.find(&program);
  if (copies == copies_of_programs_.end()) return print("  {}\n", call(program));
  const auto [first, count] = copies->second;
  print(
      "  plchost_take_copies(&plchost_copies[{0}], {1});\n  {2}\n  plchost_put_copies(&plchost_copies[{0}], "
      "{1});\n",
      first, count, call(program));
}

void GlueWriter::write_symbols() {
  print("void plchost_each_symbol(void (*use)(const struct plchost_symbol*)) {{ (void)use; }}\n");
}

Place GlueWriter::place_or_none(const Variable& variable) const {
  return plan_.locations.place(variable.location).value_or(Place{.area = ' '});
}

void GlueWriter::write_places() {
  std::string table;
  for (const Known& known : places_) {
    const Place& place = known.place;
    table += fmt::format("  {{\"{}\", '{}', {}, {}, {}, {}u, &{}}},\n", known.name, place.area, place.bytes,
                         place.bit, known.aliased ? 1 : 0, place.offset, known.value);
  }
  print(
      "const unsigned int plchost_place_count = {};\nconst struct plchost_place plchost_places[] = {{\n{}  "
      "{{0}}}};\nunsigned long long plchost_exchanged[{}];\n",
      places_.size(), table, places_.size() + 1);
}

void GlueWriter::write_locations() {
  std::string table;
  const auto places = plan_.locations.places();
  for (const auto& [location, place] : places)
    table += fmt::format("  {{\"location-{}\", {}u}},\n", location.substr(1), first_bit(place) + 1);
  print("const unsigned int plchost_location_count = {};\n", places.size());
  print("const struct plchost_location plchost_locations[] = {{\n{}  {{0}}}};\n", table);
}

// In the order of their begins, the widest first. One that begins before the others have ended shares bits.
void GlueWriter::find_aliases() {
  std::vector<std::size_t> order(places_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t number) {
    const Place& place = places_[number].place;
    return std::tuple(place.area, first_bit(place), first_bit(place) - end_bit(place), number);
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

// Within a task, two of a group may share no bits, as only another task uses the place that has both.
void GlueWriter::find_rings() {
  const auto width = [&](std::size_t number) {
    return end_bit(places_[number].place) - first_bit(places_[number].place);
  };
  rings_.resize(plan_.tasks.size());
  for (std::size_t task = 0; task < rings_.size(); ++task) {
    for (const auto& group : groups_) {
      std::vector<std::size_t> used;
      std::ranges::copy_if(group, std::back_inserter(used), [&](std::size_t number) {
        return places_[number].place.area != 'I' && places_[number].tasks.contains(task);
      });
      // The widest one of those that share bits has all others in it.
      std::ranges::stable_sort(used, std::ranges::greater(), width);
      while (!used.empty()) {
        const Place widest = places_[used.front()].place;
        const auto rest = std::ranges::stable_partition(used, [&](std::size_t number) {
          const Place& place = places_[number].place;
          return first_bit(place) >= first_bit(widest) && end_bit(place) <= end_bit(widest);
        });
        const std::vector<std::size_t> ring(used.begin(), rest.begin());
        for (std::size_t i = 0; i < ring.size() && ring.size() > 1; ++i)
          rings_[task].emplace_back(ring[i], ring[(i + 1) % ring.size()]);
        used.erase(used.begin(), rest.begin());
      }
    }
    std::ranges::stable_sort(rings_[task], std::ranges::greater(),
                             [&](const auto& entry) { return width(entry.first); });
  }
}

bool GlueWriter::has_shared_bits() const {
  return std::ranges::any_of(rings_, [](const auto& ring) { return !ring.empty(); });
}

// A task has its own copy of the outputs, so one of the two would undo what the other one wrote.
void GlueWriter::refuse_shared_bits() {
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
                     places_[group.back()].location, places_[group.front()].location,
                     fmt::join(names, ", "))});
  }
}

// Of one place, name_shared_places() of the plan does.
void GlueWriter::name_shared_memory() {
  for (const auto& group : groups_) {
    const Known& first = places_[group.front()];
    std::set<std::size_t> tasks;
    for (const std::size_t number : group)
      tasks.insert(places_[number].tasks.begin(), places_[number].tasks.end());
    const auto other =
        std::ranges::find_if(group, [&](std::size_t number) { return places_[number].place != first.place; });
    if (first.place.area != 'M' || tasks.size() < 2 || other == group.end()) continue;
    std::vector<std::string_view> names;
    for (const std::size_t task : tasks) names.emplace_back(plan_.tasks[task].name);
    plan_.remarks.push_back(
        {plan_.located.at(places_[*other].place).front()->place,
         fmt::format("{} and {} share bits, and the tasks {} use them: a task has what another one assigns "
                     "there from its next cycle on",
                     places_[*other].location, first.location, fmt::join(names, ", "))});
  }
}

void GlueWriter::write_task(const PlannedTask& task, std::size_t number) {
  const std::size_t uses = write_uses(number);
  print("static const unsigned int plchost_retained_{}[] = {{{}}};\n", number, list_of(retained_by(number)));
  print("static void plchost_run_{0}(void) {{\n  plchost_begin({0});\n", number);
  const bool shares = shares_bits(number);
  for (const Program* const program : task.programs) {
    if (shares && program != task.programs.front())
      print("  plchost_settle_places(&plchost_tasks[{}]);\n", number);
    write_call(*program);
  }
  print("  plchost_end({});\n}}\n", number);
  if (!task.single.empty()) write_edge(task, number);
  if (task.extension.options) write_options(*task.extension.options, number);
  use_counts_.push_back(uses);
}

void GlueWriter::write_edge(const PlannedTask& task, std::size_t number) {
  const auto variable = plan_.globals.find(folded(task.single));
  const Place place = variable == plan_.globals.end() ? Place{.area = ' '} : place_or_none(*variable->second);
  const auto known = std::ranges::find(places_, place, &Known::place);
  print("static unsigned char plchost_edge_{}(void) {{ return ", number);
  if (known != places_.end() && place.area == 'M') {
    print("plchost_bit_now({}); }}\n", known - places_.begin());
  } else {
    print("{}; }}\n", global(folded(task.single)));
  }
}

// The number of them. Those that share bits come first.
std::size_t GlueWriter::write_uses(std::size_t number) {
  const auto& ring = rings_[number];
  std::string uses;
  std::size_t count = 0;
  const auto write = [&](std::size_t place, const std::string& value, std::size_t next) {
    const bool is_of_others = !places_[place].tasks.contains(number);
    uses += fmt::format("  {{{}, &{}, {}, {}}},\n", place, value, is_of_others ? 1 : 0, next);
    ++count;
  };
  const auto in_ring = [&](std::size_t place) {
    return std::ranges::find(ring, place, [](const auto& entry) { return entry.first; });
  };
  for (const auto& [place, next] : ring)
    write(place, places_[place].value, static_cast<std::size_t>(in_ring(next) - ring.begin()));
  const std::set<Place> own =
      write_own_inputs(number, [&](std::size_t place, const std::string& value) { write(place, value, 0); });
  for (const std::size_t place : exchanged_by(number)) {
    if (in_ring(place) == ring.end() && !own.contains(places_[place].place))
      write(place, places_[place].value, 0);
  }
  print("static struct plchost_use plchost_uses_{}[] = {{\n{}  {{0}}}};\n", number, uses);
  return count;
}

// Those that its programs use, and the other outputs in the same bytes: a byte of the outputs is that of
// the task that has changed it last.
std::vector<std::size_t> GlueWriter::exchanged_by(std::size_t task) const {
  std::set<unsigned> bytes;
  for (const Place& place : plan_.tasks[task].places) {
    for (unsigned i = 0; place.area == 'Q' && i < place.bytes; ++i) bytes.insert(place.offset + i);
  }
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Known& known = places_[i];
    const bool beside = known.place.area == 'Q' && known.place.bit >= 0 && !known.aliased &&
                        !known.tasks.empty() && bytes.contains(known.place.offset);
    if (beside || known.tasks.contains(task)) result.push_back(i);
  }
  return result;
}

// Their numbers among the retained ones.
void GlueWriter::number_retained() {
  std::size_t next = 0;
  for (const ProgramVariable& variable : variables_.all) {
    retained_number_.push_back(next);
    if (variable.retain) ++next;
  }
}

std::vector<std::size_t> GlueWriter::retained_by(std::size_t task) const {
  std::vector<std::size_t> result;
  for (const std::size_t variable : variables_.retained[task]) result.push_back(retained_number_[variable]);
  return result;
}

void GlueWriter::write_options(const TaskOptions& options, std::size_t number) {
  using std::chrono::microseconds;
  const TaskWatchdog& watchdog = options.watchdog;
  print("static const struct plchost_options plchost_options_{} = {{{}L, {}, {}, {}u, {}u, {}u, {}}};\n",
        number, options.start_offset.count(), std::to_underlying(options.late),
        options.drives_outputs ? 1 : 0, watchdog.time / microseconds(1), watchdog.sensitivity,
        watchdog.omitted_cycles, std::to_underlying(watchdog.policy));
}

void GlueWriter::write_tasks() {
  print("const unsigned int plchost_task_count = {};\nconst struct plchost_task plchost_tasks[] = {{\n",
        plan_.tasks.size());
  for (std::size_t i = 0; i < plan_.tasks.size(); ++i) {
    const PlannedTask& task = plan_.tasks[i];
    const std::string& event = task.extension.external_event;
    print(
        "  {{\"{0}\", {1}, {2}L, {3}, plchost_run_{4}, {5}, plchost_uses_{4}, {6}, "
        "plchost_retained_{4}, {7}, {8}, {9}}},\n",
        task.name, task.priority, task.interval_ns,
        task.single.empty() ? "0" : fmt::format("plchost_edge_{}", i), i, use_counts_[i],
        variables_.retained[i].size(), event.empty() ? "0" : fmt::format("\"{}\"", event),
        task.extension.options ? fmt::format("&plchost_options_{}", i) : "0", rings_[i].size());
  }
  print("}};\n");
}

void GlueWriter::write_programs() {
  std::string rows;
  std::size_t count = 0;
  for (const PlannedTask& task : plan_.tasks) {
    for (const Program* const program : task.programs) {
      const Pou* const pou = project_.pou(program->type);  // has its name as in the source
      const std::string& type = pou == nullptr ? program->type : pou->name;
      if (program->name.size() > kMaxVariableName || type.size() >= kMaxVariableBytes) {
        plan_.remarks.push_back(
            {program->place,
             fmt::format("an export of the plant does not have the program {}: its name or that "
                         "of its type is too long",
                         program->name)});
        continue;
      }
      rows += fmt::format("  {{\"{}\", \"{}\", \"{}\"}},\n", program->name, type, task.name);
      ++count;
    }
  }
  print(
      "const unsigned int plchost_program_count = {};\nconst struct plchost_program plchost_programs[] = "
      "{{\n{}  {{0}}}};\n",
      count, rows);
}

void GlueWriter::write_variables() {
  print(
      "PLCHOST_ONCE void plchost_each_variable(void (*use)(const struct plchost_variable*)) {{\n"
      "  struct plchost_variable v;\n  (void)use;\n  (void)v;\n");
  for (const ProgramVariable& variable : variables_.all) {
    print(
        "  v.path = \"{0}\"; v.value = &{1}; v.bytes = sizeof {1}; v.layout = {2}ull; v.retain = {3}; "
        "use(&v);\n",
        variable.path, variable.value, variable.layout, variable.retain ? 1 : 0);
  }
  print("}}\n");
}

}  // namespace plchost::iec
