#include "instances/adapters/matiec/glue.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/matiec/symbols.hpp"

namespace plchost::matiec {

namespace {

using iec::folded;
using iec::Place;

// As iec2c calls a resource that has no name.
std::string name_in_c(const iec::Resource& resource) {
  return resource.name.empty() ? "RESOURCE" : folded(resource.name);
}

class Writer : public iec::GlueWriter {
 public:
  Writer(const iec::Project& project, const iec::Configuration& configuration, const iec::Resource& resource,
         const std::vector<Located>& located, std::span<const iec::DebugPou> pous)
      : GlueWriter(project, configuration, resource, iec::Compiler::matiec), located_(located), pous_(pous) {}

 private:
  void write_head() override {
    print("/* Written by plcctl build application. */\n#include \"plchost_adapter.h\"\n");
    if (has_shared_bits()) print("#include \"plchost_assigned.h\"\n");
    print("#include \"{}.c\"\n\n", resource().name.empty() ? "RESOURCE" : resource().name);
    print("BOOL __DEBUG;\nvoid config_init__(void);\n");
    // The file of the resource has a macro for each instance.
    for (const iec::Program& program : resource().programs) print("#undef {}\n", folded(program.name));
    write_other_resources();
  }
  // The file of the configuration calls all of them. Each is an application of its own.
  void write_other_resources() {
    for (const iec::Resource& other : configuration().resources) {
      if (&other == &resource()) continue;
      print("void {0}_init__(void) {{}}\nvoid {0}_run__(unsigned long tick) {{ (void)tick; }}\n",
            name_in_c(other));
    }
  }

  // iec2c writes one for each declaration, and several may have one address.
  void find_places() override {
    for (const Located& pointer : located_) {
      const auto place = plan().locations.place(pointer.location);
      if (!place || !plan().located.contains(*place)) {
        const auto written = project().locations.find(pointer.location);
        plan().problems.push_back(
            {written == project().locations.end() ? configuration().place : written->second,
             fmt::format("{}: the declaration around it is not understood", pointer.location)});
        continue;
      }
      const auto [number, is_new] = numbers_.try_emplace(*place, places().size());
      if (is_new) {
        places().push_back({.name = pointer.name,
                            .value = fmt::format("plchost_value_{}", places().size()),
                            .location = pointer.location,
                            .place = *place});
        pointers_.emplace_back();
      }
      auto& known = pointers_[number->second];
      if (std::ranges::find(known, pointer.name, &Located::name) == known.end()) known.push_back(&pointer);
    }
    for (std::size_t i = 0; i < plan().tasks.size(); ++i) {
      for (const Place& place : plan().tasks[i].places) {
        if (const auto number = numbers_.find(place); number != numbers_.end())
          places()[number->second].tasks.insert(i);
      }
    }
  }
  void write_storage() override {
    for (std::size_t i = 0; i < pointers_.size(); ++i) {
      const std::string& type = pointers_[i].front()->type;
      print("static {} plchost_value_{};\n", type, i);
      for (const Located* const pointer : pointers_[i])
        print("{} *{} = &plchost_value_{};\n", type, pointer->name, i);
    }
  }

  [[nodiscard]] std::string call(const iec::Program& program) const override {
    return fmt::format("{}_body__(&{}__{});", folded(program.type), name_in_c(resource()),
                       folded(program.name));
  }
  [[nodiscard]] std::string global(const std::string& name) const override {
    return fmt::format("*__GET_GLOBAL_{}()", name);
  }
  [[nodiscard]] CopyText copy(const iec::CopiedGlobal& global, std::size_t number) const override {
    const std::string value = fmt::format("plchost_copy_{}", number);
    std::string piece = value + (global.dimensions > 0 ? ".table" : "");
    for (std::size_t i = 0; i < global.dimensions; ++i) piece += "[0]";
    return {.storage = fmt::format("static __typeof__(*{}.value) {}, plchost_before_{};",
                                   global.externals.front(), value, number),
            .value = value,
            .piece = std::move(piece),
            .global = fmt::format("__GET_GLOBAL_{}()", global.name),
            .external_end = ".value"};
  }

  // Inputs of programs that several tasks use: no other task changes them in the middle of a cycle.
  std::set<Place> write_own_inputs(std::size_t number, const AddUse& add) override {
    const iec::PlannedTask& task = plan().tasks[number];
    std::set<Place> own;
    std::set<Place> shared;
    for (const std::string& name : task.globals) shared.insert(place_or_none(*plan().globals.at(name)));
    for (const iec::Program* const program : task.programs) {
      std::string pointers;
      const iec::Pou* const type = project().pou(program->type);
      if (type == nullptr) continue;
      for (const iec::Variable& variable : type->variables) {
        const Place place = place_or_none(variable);
        const auto known = numbers_.find(place);
        if (place.area != 'I' || known == numbers_.end() || places()[known->second].tasks.size() < 2)
          continue;
        const std::string value = fmt::format("plchost_input_{}_{}", number, known->second);
        for (const Located* const pointer : pointers_[known->second])
          pointers += fmt::format("  {} = &{};\n", pointer->name, value);
        if (!own.insert(place).second) continue;
        print("static {} {};\n", pointers_[known->second].front()->type, value);
        own_values_[{place, number}] = value;
        add(known->second, value);
      }
      if (pointers.empty()) continue;
      bindings_ += fmt::format("{}  {}_init__(&{}__{}, 0);\n", pointers, folded(program->type),
                               name_in_c(resource()), folded(program->name));
    }
    std::erase_if(own, [&](const Place& place) { return shared.contains(place); });
    return own;
  }
  void write_symbols() override {
    const auto value_of_place = [this](const Place& place, std::optional<std::size_t> task) -> std::string {
      if (const auto own = own_values_.find({place, task.value_or(plan().tasks.size())});
          own != own_values_.end())
        return own->second;
      const auto known = numbers_.find(place);
      return known == numbers_.end() ? "" : places()[known->second].value;
    };
    const Symbols symbols = symbols_of(project(), resource(), plan(), value_of_place);
    std::ranges::copy(symbols.remarks, std::back_inserter(plan().remarks));
    print(
        "PLCHOST_ONCE void plchost_each_symbol(void (*use)(const struct plchost_symbol*)) {{\n"
        "  struct plchost_symbol s = {{0}};\n  (void)use;\n  (void)s;\n");
    for (const Symbol& symbol : symbols.all) write_symbol(symbol);
    print("}}\n");
    if (!pous_.empty()) write_debugging(symbols);
  }
  // In a debug build: the POUs, and where their variables are.
  void write_debugging(const Symbols& symbols) {
    std::vector<iec::DebugInstance> instances;
    for (const SymbolInstance& instance : symbols.instances) {
      const auto pou = std::ranges::find(pous_, instance.type,
                                         [](const iec::DebugPou& known) { return folded(known.name); });
      if (pou == pous_.end()) continue;
      instances.push_back({.pou = static_cast<std::size_t>(pou - pous_.begin()),
                           .value = instance.value,
                           .path = instance.path});
    }
    print("{}", iec::debug_declarations(pous_, instances));
  }
  void write_symbol(const Symbol& symbol) {
    const auto text = [](const std::string& name) {
      return name.empty() ? "0" : fmt::format("\"{}\"", name);
    };
    print(
        "  s.name = \"{0}\"; s.type = {1}u; s.value = &{2}; s.bytes = sizeof {2}; s.read_only = {3}; s.task "
        "= {4}; "
        "s.area = {5}; s.dimensions = {6}u;",
        symbol.name, symbol.type, symbol.value, symbol.read_only ? 1 : 0, text(symbol.task),
        text(symbol.area), symbol.dimensions.size());
    for (std::size_t i = 0; i < symbol.dimensions.size(); ++i) {
      const Symbol::Dimension& dimension = symbol.dimensions[i];
      print(" s.dimension[{0}].first = {1}; s.dimension[{0}].count = {2}u; s.dimension[{0}].stride = {3};", i,
            dimension.first, dimension.count, dimension.stride);
    }
    print(" use(&s);\n");
  }
  void write_binding() override {
    print("void plchost_bind(void) {{\n  plchost_set_ticktime();\n  config_init__();\n{}", bindings_);
    write_copy_bindings();
    print("}}\n");
  }

  const std::vector<Located>& located_;
  std::span<const iec::DebugPou> pous_;
  std::vector<std::vector<const Located*>> pointers_;                // for each place
  std::map<Place, std::size_t> numbers_;                             // of places
  std::map<std::pair<Place, std::size_t>, std::string> own_values_;  // of inputs, by the number of the task
  std::string bindings_;
};

}  // namespace

iec::Glue write_glue(const iec::Project& project, const iec::Configuration& configuration,
                     const iec::Resource& resource, const std::vector<Located>& located,
                     std::span<const iec::DebugPou> pous) {
  return Writer(project, configuration, resource, located, pous).write();
}

}  // namespace plchost::matiec
