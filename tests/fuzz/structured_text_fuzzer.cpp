#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/task_file.hpp"
#include "instances/adapters/matiec/glue.hpp"
#include "instances/adapters/matiec/iec2c.hpp"
#include "shm/base/names.hpp"

namespace {

using namespace plchost;

constexpr std::array<std::string_view, 41> kWords{"CONFIGURATION ",
                                                  "END_CONFIGURATION ",
                                                  "RESOURCE ",
                                                  "ON ",
                                                  "END_RESOURCE ",
                                                  "TASK ",
                                                  "PROGRAM ",
                                                  "END_PROGRAM ",
                                                  "WITH ",
                                                  "VAR ",
                                                  "VAR_GLOBAL ",
                                                  "VAR_EXTERNAL ",
                                                  "END_VAR ",
                                                  "RETAIN ",
                                                  "CONSTANT ",
                                                  "AT ",
                                                  "%IX0.1 ",
                                                  "%QW2 ",
                                                  "%QW0.1.2 ",
                                                  "BOOL ",
                                                  "INT ",
                                                  "a ",
                                                  "b ",
                                                  "c ",
                                                  "INTERVAL ",
                                                  "SINGLE ",
                                                  "PRIORITY ",
                                                  ":= ",
                                                  "T#10ms ",
                                                  "1 ",
                                                  ", ",
                                                  "; ",
                                                  ": ",
                                                  "( ",
                                                  ") ",
                                                  "TYPE ",
                                                  "END_TYPE ",
                                                  "STRUCT ",
                                                  "END_STRUCT ",
                                                  "FUNCTION_BLOCK ",
                                                  "END_FUNCTION_BLOCK "};

constexpr std::array<std::string_view, 21> kTomlWords{"[task.t]\n",
                                                      "[task.q]\n",
                                                      "[resource.a.task.t]\n",
                                                      "[resource.d.task.t]\n",
                                                      "external_event=",
                                                      "late_policy=",
                                                      "start_offset=",
                                                      "drives_outputs=",
                                                      "watchdog_time=",
                                                      "watchdog_sensitivity=",
                                                      "watchdog_omitted_cycles=",
                                                      "watchdog_policy=",
                                                      "scheduler=",
                                                      "locations='separate'\n",
                                                      "[location]\n'%IW0.1'='%IW1'\n",
                                                      "true\n",
                                                      "'asap'\n",
                                                      "'task'\n",
                                                      "'product'\n",
                                                      "'5ms'\n",
                                                      "1\n"};
constexpr const char* kTwoResources =
    "CONFIGURATION c RESOURCE a ON b TASK t (INTERVAL := T#10ms, PRIORITY := 1); PROGRAM p WITH t : Main; "
    "PROGRAM q : Main; END_RESOURCE RESOURCE d ON b TASK t (SINGLE := x, PRIORITY := 1); PROGRAM p WITH t : "
    "Main; END_RESOURCE END_CONFIGURATION";

/// Bytes alone seldom make a word.
std::string text_of(std::span<const std::uint8_t> bytes, std::span<const std::string_view> words) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    if (byte < words.size()) {
      text += words[byte];
    } else {
      text += static_cast<char>(byte);
    }
  }
  return text;
}

// Names go into a C file.
void require_name(const std::string& name) {
  const auto belongs = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.';
  };
  if (!std::ranges::all_of(name, belongs)) std::abort();
}

void require_places(const iec::SourceProblems& problems, const char* file = "a.st") {
  for (const iec::SourceProblem& problem : problems) {
    if (problem.place.file != file || problem.place.line == 0 || problem.text.empty()) std::abort();
  }
}

// Names of events go into the C file, too.
void read_task_file(const std::string& text) {
  const std::array<iec::Source, 1> sources{{{"a.st", kTwoResources}}};
  iec::Project project = iec::read_project(sources).project;
  iec::Configuration& configuration = project.configurations.front();
  require_places(iec::read_task_file({"a.toml", text}, configuration), "a.toml");
  for (iec::Resource& resource : configuration.resources) {
    for (const iec::Task& task : resource.tasks) {
      if (!std::ranges::all_of(task.extension.external_event, is_name_character)) std::abort();
    }
    (void)matiec::write_glue(project, configuration, resource, {});
  }
}

}  // namespace

// Any text comes to an end; problems have a place in it; nothing but names goes into the C file.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = text_of({data, size}, kWords);
  read_task_file(text_of({data, size}, kTomlWords));
  const std::string raw(reinterpret_cast<const char*>(data), size);
  read_task_file(raw);
  const std::array<iec::Source, 1> as_it_is{{{"a.st", raw}}};
  require_places(iec::read_project(as_it_is).problems);
  const std::array<iec::Source, 1> sources{{{"a.st", text}}};
  const auto [project, problems] = iec::read_project(sources);
  require_places(problems);
  (void)matiec::problems_of(raw, matiec::JoinedSource(sources), project, "/nowhere");
  const auto located = matiec::located_variables(raw);
  if (!problems.empty()) return 0;
  for (const iec::Configuration& configuration : project.configurations) {
    require_name(configuration.name);
    for (const iec::Resource& resource : configuration.resources) {
      require_name(resource.name);
      for (const iec::Task& task : resource.tasks) require_name(task.name + task.single);
      for (const iec::Program& program : resource.programs) require_name(program.name + program.type);
      const iec::Glue glue = matiec::write_glue(project, configuration, resource, {});
      require_places(glue.problems);
      require_places(glue.remarks);
      (void)matiec::write_glue(project, configuration, resource, located);
    }
  }
  return 0;
}
