#include "api/cli/verbs/exported_instance.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

#include "api/cli/rows/variable_rows.hpp"
#include "api/dds/text.hpp"
#include "instances/adapters/iec/tokens.hpp"
#include "shm/base/task_kind.hpp"
#include "shm/base/trimmed.hpp"

namespace plchost {

namespace {

using plcopen::ExportedInstance;
using plcopen::ExportedProgram;
using plcopen::ExportedTask;
using plcopen::ExportedVariable;
using ExportedKind = ExportedTask::Kind;

// A kind that only a newer host knows is written as one that needs neither interval nor event.
ExportedKind kind_of(std::uint32_t kind) {
  const TaskKindTraits* const traits = find_traits(static_cast<TaskKind>(kind));
  if (traits == nullptr) return ExportedKind::freewheeling;
  if (traits->has_interval) return ExportedKind::cyclic;
  if (traits->names_event) return ExportedKind::external;
  return traits->reads_variable ? ExportedKind::event : ExportedKind::freewheeling;
}

ExportedTask task_of(const plc_TaskStatus& task) {
  return {.name = std::string(dds::text_of(task.task)),
          .kind = kind_of(task.kind),
          .priority = task.priority,
          .interval_ns = task.interval_ns,
          .event = std::string(dds::text_of(task.external_event))};
}

constexpr std::string_view kText = "STRING[";  // also behind the W of "WSTRING["
constexpr std::string_view kLengthOfMatiec = "126";
constexpr std::string_view kLengthOfStrucpp = "254";

// Behind "ARRAY ... OF "; empty: of no text.
std::string_view text_length_in(std::string_view type) {
  const std::size_t of = type.find("] OF ");
  if (of != std::string_view::npos) type.remove_prefix(of + 5);
  if (type.starts_with('W')) type.remove_prefix(1);
  if (!type.starts_with(kText)) return {};
  return type.substr(kText.size(), type.find(']') - kText.size());
}

// Of an application with the one length of MATIEC no text has a length: its build takes some only without it.
bool tell_lengths(std::span<const ListedVariable> variables) {
  return std::ranges::any_of(variables, [](const ListedVariable& variable) {
    const std::string_view length = text_length_in(dds::text_of(variable.type));
    return !is_program(variable) && !length.empty() && length != kLengthOfMatiec;
  });
}

// "Pump[].speed[][]" as ARRAY [1..4, 0..2, 0..3] OF INT: "Pump[1..4].speed", ARRAY [0..2, 0..3] OF INT.
ExportedVariable variable_of(const plc_VariableRecord& record, bool with_lengths) {
  const std::string_view area = dds::text_of(record.area);
  const bool retain = area == "retain";  // plc_variables.h
  ExportedVariable variable{
      .path = "", .type = "", .address = retain ? "" : std::string(area), .retain = retain};
  std::string_view type = dds::text_of(record.type);
  std::string_view bounds;  // "1..4, 0..2, 0..3"
  if (const std::size_t begin = type.find(" ["); type.starts_with("ARRAY")) {
    const std::size_t end = type.find("] OF ");
    if (begin == std::string_view::npos || end == std::string_view::npos) return variable;
    bounds = type.substr(begin + 2, end - begin - 2);
    type.remove_prefix(end + 5);
  }
  std::string here;  // the bounds of the word that is read
  for (std::string_view name = dds::text_of(record.name); !name.empty();) {
    if (name.starts_with("[]")) {
      const std::size_t comma = bounds.find(", ");
      here += fmt::format("{}{}", here.empty() ? "" : ", ", bounds.substr(0, comma));
      bounds.remove_prefix(comma == std::string_view::npos ? bounds.size() : comma + 2);
      name.remove_prefix(2);
      continue;
    }
    if (!here.empty()) variable.path += "[" + std::exchange(here, {}) + "]";
    variable.path += name.front();
    name.remove_prefix(1);
  }
  const std::string_view length = text_length_in(type);
  if (!length.empty() && (!with_lengths || length == kLengthOfStrucpp)) type = type.substr(0, type.find('['));
  variable.type = here.empty() ? std::string(type) : fmt::format("ARRAY [{}] OF {}", here, type);
  return variable;
}

/// Those of one first word.
struct VariableGroup {
  std::string word;
  std::string task;  ///< of all of them; empty: several, or any
};

ExportedProgram program_of(const ExportedTask& task, std::string name, std::string type) {
  // In ST a program without a task is a freewheeling one of its own name.
  const bool is_the_task =
      task.kind == ExportedKind::freewheeling && iec::folded(name) == iec::folded(task.name);
  return {.name = std::move(name), .type = std::move(type), .task = is_the_task ? "" : task.name};
}

std::vector<VariableGroup> groups_of(std::span<const ListedVariable> variables) {
  std::vector<VariableGroup> groups;
  for (const plc_VariableRecord& variable : variables) {
    const std::string_view name = dds::text_of(variable.name);
    const std::size_t dot = name.find('.');
    if (dot == std::string_view::npos || name.substr(0, dot).contains('[')) continue;
    const std::string_view task = dds::text_of(variable.task);
    if (groups.empty() || iec::folded(groups.back().word) != iec::folded(name.substr(0, dot))) {
      groups.push_back({.word = std::string(name.substr(0, dot)), .task = std::string(task)});
    } else if (groups.back().task != task) {
      groups.back().task.clear();
    }
  }
  std::erase_if(groups, [](const VariableGroup& group) { return group.task.empty(); });
  return groups;
}

}  // namespace

ExportedInstance exported_instance(std::string_view name, std::span<const plc_TaskStatus> tasks,
                                   std::span<const ListedVariable> variables) {
  ExportedInstance instance{.name = std::string(name), .tasks = {}, .programs = {}, .variables = {}};
  std::vector<ListedVariable> programs;
  const bool with_lengths = tell_lengths(variables);
  for (const ListedVariable& variable : variables) {
    if (is_program(variable)) {
      programs.push_back(variable);
    } else {
      instance.variables.push_back(variable_of(variable, with_lengths));
    }
  }
  const std::vector<VariableGroup> groups =
      programs.empty() ? groups_of(variables) : std::vector<VariableGroup>();
  for (const plc_TaskStatus& one : tasks) {
    if (dds::text_of(one.instance) != name) continue;
    const ExportedTask& task = instance.tasks.emplace_back(task_of(one));
    const std::size_t before = instance.programs.size();
    for (const plc_VariableRecord& program : programs) {
      if (dds::text_of(program.task) != task.name) continue;
      instance.programs.push_back(program_of(task, std::string(dds::text_of(program.name)),
                                             std::string(trimmed(dds::text_of(program.value), "'"))));
    }
    for (const VariableGroup& group : groups) {
      if (group.task == task.name)
        instance.programs.push_back(program_of(task, group.word, group.word + "_type"));
    }
    if (instance.programs.size() > before) continue;
    const bool freewheels = task.kind == ExportedKind::freewheeling;
    const std::string program = freewheels ? task.name : task.name + "_program";
    instance.programs.push_back(
        {.name = program, .type = program + "_type", .task = freewheels ? "" : task.name});
  }
  return instance;
}

}  // namespace plchost
