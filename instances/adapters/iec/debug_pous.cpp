#include "instances/adapters/iec/debug_pous.hpp"

#include <algorithm>
#include <ranges>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <header_macros.hpp>

#include "shm/variables/variable_symbol.hpp"

namespace plchost::iec {

namespace {

std::string in_quotes(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + '"';
}

std::vector<unsigned> ascending(std::vector<unsigned> lines) {
  std::ranges::sort(lines);
  const auto twice = std::ranges::unique(lines);
  lines.erase(twice.begin(), twice.end());
  return lines;
}

// A row for each that is an array; empty: none is.
std::string declared_arrays(std::size_t pou, std::span<const DebugLocal> locals) {
  std::string rows;
  std::size_t count = 0;
  for (std::size_t i = 0; i < locals.size(); ++i) {
    if (locals[i].dimensions.empty()) continue;
    ++count;
    const auto dimensions = std::views::transform(locals[i].dimensions, [](const DebugLocal::Dimension& one) {
      return fmt::format("{{{}, {}u, {}}}", one.first, one.count, one.stride);
    });
    rows += fmt::format("    {{{}u, {}u, {{{}}}}},\n", i, locals[i].dimensions.size(),
                        fmt::join(dimensions, ", "));
  }
  if (rows.empty()) return "";
  return fmt::format(
      "  static const Plc_LocalArray plchost_arrays_{0}[] = {{\n{1}  }};\n"
      "  plchost_pou_{0}.pArrays = plchost_arrays_{0};\n"
      "  plchost_pou_{0}.nArrays = {2}u;\n"
      "  plchost_pou_{0}.dwSize = sizeof(Plc_Pou);\n",
      pou, rows, count);
}

// Their types are known only behind the program.
std::string declared_locals(std::size_t pou, std::span<const DebugLocal> locals) {
  if (locals.empty()) return "";
  std::string text = fmt::format("  static const Plc_Local plchost_locals_{}[] = {{\n", pou);
  for (const DebugLocal& local : locals) {
    text += fmt::format("    {{\"{}\", {}, {}, {}u, {}u}},\n", local.name, local.type, local.bytes,
                        local.first_line, local.last_line);
  }
  return text +
         fmt::format(
             "  }};\n  plchost_pou_{0}.pLocals = plchost_locals_{0};\n"
             "  plchost_pou_{0}.nLocals = {1}u;\n",
             pou, locals.size()) +
         declared_arrays(pou, locals);
}

}  // namespace

bool are_allowed(std::span<const DebugLocal::Dimension> dimensions) noexcept {
  std::uint64_t elements = 1;
  for (const DebugLocal::Dimension& one : dimensions) {
    const std::int64_t last = one.first + static_cast<std::int64_t>(one.count) - 1;
    if (one.count == 0 || one.count > kMaxVariableElements || one.first < INT32_MIN || last > INT32_MAX)
      return false;
    elements *= one.count;
    if (elements > kMaxVariableElements) return false;
  }
  return dimensions.size() <= kMaxVariableDimensions;
}

// A POU without an array says the size of before there were any: each runtime takes it.
std::string debug_header(std::span<const DebugPou> pous) {
  std::string text = "/* Written by plcctl build application. */\n#include \"plc_debug.h\"\n";
  for (const std::string_view macro : kHeaderMacros) text += fmt::format("#undef {}\n", macro);
  for (std::size_t i = 0; i < pous.size(); ++i) {
    const std::vector<unsigned> lines = ascending(pous[i].lines);
    text += fmt::format(
        "static const unsigned int plchost_lines_{0}[] = {{{1}u}};\n"
        "static Plc_Pou plchost_pou_{0} = {{__builtin_offsetof(Plc_Pou, pArrays), \"{2}\", {3}, "
        "plchost_lines_{0}, {4}u, 0u, 0, "
        "0u, 0, 0u}};\n",
        i, fmt::join(lines, "u, "), pous[i].name, in_quotes(pous[i].file), lines.size());
  }
  return text;
}

std::string debug_enter(std::size_t pou, std::string_view self, std::span<const DebugLocal> locals,
                        std::size_t first) {
  if (locals.empty()) return fmt::format("  PLC_ENTER(plchost_pou_{}, {});\n", pou, self);
  const auto addresses = std::views::transform(locals, &DebugLocal::address);
  return fmt::format(
      "  void* const plchost_locals_[] = {{{}}};\n  PLC_ENTER_LOCALS(plchost_pou_{}, {}, plchost_locals_, "
      "{}u);\n",
      fmt::join(addresses, ", "), pou, self, first);
}

std::string debug_statement(unsigned line) {
  return fmt::format("PLC_STATEMENT({}u);\n", line);
}

std::string debug_declarations(std::span<const DebugPou> pous, std::span<const DebugInstance> instances) {
  std::string text = "int plchost_declare_debugging(void) {\n  int good = 1;\n";
  for (std::size_t i = 0; i < pous.size(); ++i) {
    text += declared_locals(i, pous[i].locals);
    text += fmt::format("  good = good && plc_debug_declare_pou(&plchost_pou_{}) == 0;\n", i);
  }
  for (const DebugInstance& instance : instances) {
    text += fmt::format("  good = good && plc_debug_declare_instance(&plchost_pou_{}, &{}, \"{}\") == 0;\n",
                        instance.pou, instance.value, instance.path);
  }
  return text + "  return good;\n}\n";
}

}  // namespace plchost::iec
