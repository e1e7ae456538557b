#include "instances/adapters/strucpp/glue.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/strucpp/instances.hpp"
#include "instances/adapters/strucpp/symbols.hpp"

namespace plchost::strucpp {

namespace {

using iec::folded;

class Writer : public iec::GlueWriter {
 public:
  Writer(const iec::Project& project, const iec::Configuration& configuration, const iec::Resource& resource,
         std::span<const std::string> files, std::span<const PlannedSymbol> symbols,
         std::span<const iec::DebugPou> pous)
      : GlueWriter(project, configuration, resource, iec::Compiler::strucpp),
        files_(files),
        symbols_(symbols),
        pous_(pous) {}

 private:
  void write_head() override {
    print("// Written by plcctl build application.\n#include \"plchost_strucpp.hpp\"\n");
    if (!pous_.empty()) print("#include \"{}\"\n", iec::kDebugFile);
    for (const std::string& file : files_) print("#include \"{}\"\n", file);
    print("\nstrucpp::Configuration_{} g_config;\n", folded(configuration().name));
  }

  // Each variable has a value of its own, also where two have one location.
  void find_places() override {
    for (std::size_t i = 0; i < plan().tasks.size(); ++i) {
      for (const iec::Program* const program : plan().tasks[i].programs) add_program(*program, i);
    }
    for (const auto& [name, variable] : plan().globals) {
      if (variable->location.empty()) continue;
      std::set<std::size_t> tasks;
      for (std::size_t i = 0; i < plan().tasks.size(); ++i) {
        if (plan().tasks[i].globals.contains(name)) tasks.insert(i);
      }
      add(name, "strucpp::" + variable->member, *variable, std::move(tasks));
    }
  }
  void add_program(const iec::Program& program, std::size_t task) {
    const iec::Pou* const type = project().pou(program.type);
    if (type == nullptr) return;
    for (const iec::Variable& variable : type->variables) {
      if (variable.location.empty() || variable.member.empty()) continue;
      const std::string name = folded(program.name);
      add(fmt::format("{}.{}", name, folded(variable.name)),
          fmt::format("g_config.{}.{}", name, variable.member), variable, {task});
    }
  }
  void add(const std::string& name, const std::string& value, const iec::Variable& variable,
           std::set<std::size_t> tasks) {
    // Without one there is a problem already.
    const auto place = plan().locations.place(variable.location);
    if (!place) return;
    places().push_back({.name = name,
                        .value = fmt::format("*{}.raw_ptr()", value),
                        .location = variable.location,
                        .place = *place,
                        .tasks = std::move(tasks)});
  }

  [[nodiscard]] std::string call(const iec::Program& program) const override {
    return fmt::format("plchost_run(g_config.{});", folded(program.name));
  }
  [[nodiscard]] std::string global(const std::string& name) const override {
    const auto found = plan().globals.find(name);
    if (found == plan().globals.end()) return "0";  // there is a problem already
    return fmt::format("*strucpp::{}.raw_ptr() ? 1 : 0", found->second->member);
  }
  void write_symbols() override {
    const Symbols found = symbols_of(project(), plan(), symbols_);
    std::ranges::copy(found.remarks, std::back_inserter(plan().remarks));
    print(
        "PLCHOST_ONCE void plchost_each_symbol(void (*use)(const struct plchost_symbol*)) {{\n  "
        "(void)use;\n");
    for (const Symbol& symbol : found.all) write_symbol(symbol);
    print("}}\n");
    if (pous_.empty()) return;
    print("extern \"C\" {}",
          iec::debug_declarations(pous_, instances_of(project(), plan(), found.all, pous_)));
  }
  void write_symbol(const Symbol& symbol) {
    const auto text = [](const std::string& name) {
      return name.empty() ? "nullptr" : fmt::format("\"{}\"", name);
    };
    std::string indexes;
    std::string dimensions;
    for (std::size_t i = 0; i < symbol.bounds.size(); ++i) {
      const auto [first, last] = symbol.bounds[i];
      indexes += fmt::format(", long i{}", i);
      dimensions += fmt::format("{{{}, {}u}}, ", first, std::int64_t{last} - first + 1);
    }
    print(
        "  plchost_show<{0}>(use, {1}, [](auto& c{2}) -> decltype(({3})) {{ return {3}; }},\n"
        "                  {{\"{4}\", {5}u, {6}u, {7}u, {8}, {9}, {{{10}}}}});\n",
        symbol.bounds.size(), symbol.root, indexes, symbol.value, symbol.name, symbol.type, symbol.bytes,
        symbol.read_only ? 1 : 0, text(symbol.task), text(symbol.area), dimensions);
  }
  [[nodiscard]] CopyText copy(const iec::CopiedGlobal& global, std::size_t number) const override {
    const std::string value = fmt::format("plchost_copy_{}.value", number);
    const std::string member = "strucpp::" + global.variable->member;  // X.value
    return {.storage = fmt::format("static std::remove_pointer_t<decltype({1})> plchost_copy_{0};\n"
                                   "static decltype(plchost_copy_{0}.value) plchost_before_{0};",
                                   number, global.externals.front()),
            .value = value,
            .piece = fmt::format("(plchost_piece(plchost_before_{}))", number),
            .locked = fmt::format("[](const plchost_copy* copy, void (*work)(const plchost_copy*)) {{ "
                                  "{}.with_lock([&](auto*) {{ work(copy); }}); }}",
                                  member.substr(0, member.rfind('.'))),
            .global = "&" + member,
            .external_end = ""};
  }
  // The constructors have done the rest.
  void write_binding() override {
    print("void plchost_bind(void) {{\n");
    write_copy_bindings();
    print("}}\n");
  }

  std::span<const std::string> files_;
  std::span<const PlannedSymbol> symbols_;
  std::span<const iec::DebugPou> pous_;
};

}  // namespace

iec::Glue write_glue(const iec::Project& project, const iec::Configuration& configuration,
                     const iec::Resource& resource, std::span<const std::string> files,
                     std::span<const PlannedSymbol> symbols, std::span<const iec::DebugPou> pous) {
  return Writer(project, configuration, resource, files, symbols, pous).write();
}

}  // namespace plchost::strucpp
