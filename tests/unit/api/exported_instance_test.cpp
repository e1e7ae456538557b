// Tasks and variables, as DDS tells them, become those of PLCopen.
#include "api/cli/verbs/exported_instance.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "api/dds/text.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;

constexpr unsigned kCyclicKind = 0;
constexpr unsigned kExternalKind = 2;
constexpr unsigned kFreewheelingKind = 3;

plc_TaskStatus task(const char* instance, const char* name, unsigned kind) {
  plc_TaskStatus task{};
  dds::copy_text(task.instance, instance);
  dds::copy_text(task.task, name);
  task.kind = kind;
  task.priority = 3;
  task.interval_ns = kind == kCyclicKind ? 250'000 : 0;
  if (kind == kExternalKind) dds::copy_text(task.external_event, "product");
  return task;
}

plc_VariableRecord variable(const char* name, const char* type, const char* of_task = "",
                            const char* area = "") {
  plc_VariableRecord variable{};
  dds::copy_text(variable.name, name);
  dds::copy_text(variable.type, type);
  dds::copy_text(variable.task, of_task);
  dds::copy_text(variable.area, area);
  return variable;
}

std::vector<std::string> programs_of(const plcopen::ExportedInstance& instance) {
  std::vector<std::string> programs;
  for (const plcopen::ExportedProgram& program : instance.programs)
    programs.push_back(program.name + " : " + program.type + " WITH " + program.task);
  return programs;
}

TEST(ExportedInstance, HasTheTasksOfThisInstanceOnly) {
  const std::vector<plc_TaskStatus> tasks{task("line1", "fast", kCyclicKind), task("line2", "other", 1),
                                          task("line1", "done", kExternalKind), task("line1", "odd", 99)};
  const auto sut = exported_instance("line1", tasks, {});
  EXPECT_EQ(sut.name, "line1");
  ASSERT_EQ(sut.tasks.size(), 3U);
  EXPECT_EQ(sut.tasks[0].kind, plcopen::ExportedTask::Kind::cyclic);
  EXPECT_EQ(sut.tasks[0].interval_ns, 250'000);
  EXPECT_EQ(sut.tasks[0].priority, 3);
  EXPECT_EQ(sut.tasks[1].kind, plcopen::ExportedTask::Kind::external);
  EXPECT_EQ(sut.tasks[1].event, "product");
  EXPECT_EQ(sut.tasks[2].kind, plcopen::ExportedTask::Kind::freewheeling) << "one of a later version";
}

TEST(ExportedInstance, HasAProgramForEachFirstWordThatOneTaskUsesAlone) {
  const std::vector<plc_TaskStatus> tasks{
      task("line1", "fast", kCyclicKind), task("line1", "rest", kFreewheelingKind),
      task("line1", "alone", kFreewheelingKind), task("line1", "done", kExternalKind)};
  const std::vector<ListedVariable> variables{variable("grid[].x", "ARRAY [1..2] OF INT", "fast"),
                                              variable("limit", "INT", "fast"),
                                              variable("main.a", "INT", "fast"),
                                              variable("MAIN.b", "INT", "fast"),
                                              variable("rest.a", "INT", "rest"),
                                              variable("shared.a", "INT", "fast"),
                                              variable("shared.b", "INT", "rest"),
                                              variable("some.a", "INT")};
  EXPECT_THAT(programs_of(exported_instance("line1", tasks, variables)),
              ElementsAre("main : main_type WITH fast", "rest : rest_type WITH ", "alone : alone_type WITH ",
                          "done_program : done_program_type WITH done"));
}

TEST(ExportedInstance, HasTheProgramsThatTheApplicationDeclares) {
  const std::vector<plc_TaskStatus> tasks{task("line1", "fast", kCyclicKind),
                                          task("line1", "done", kExternalKind),
                                          task("line1", "rest", kFreewheelingKind)};
  const auto program = [](const char* name, const char* type, const char* of_task) {
    plc_VariableRecord record = variable(name, "STRING[80]", of_task, "program");
    dds::copy_text(record.value, type);
    return record;
  };
  const std::vector<ListedVariable> variables{
      program("one", "'Press'", "fast"), variable("one.a", "INT", "fast"),
      program("Rest", "'Cleaning'", "rest"), variable("some.a", "INT", "fast"),
      program("two", "'Press'", "fast")};
  const auto sut = exported_instance("line1", tasks, variables);
  EXPECT_EQ(sut.variables.size(), 2U);
  EXPECT_THAT(programs_of(sut),
              ElementsAre("one : Press WITH fast", "two : Press WITH fast",
                          "done_program : done_program_type WITH done", "Rest : Cleaning WITH "));
}

TEST(ExportedInstance, HasTheVariablesThatAreRetained) {
  const std::vector<ListedVariable> variables{variable("total", "INT", "", "retain"),
                                              variable("x", "INT", "", "%QW1")};
  const auto sut = exported_instance("line1", {}, variables);
  ASSERT_EQ(sut.variables.size(), 2U);
  EXPECT_TRUE(sut.variables[0].retain);
  EXPECT_EQ(sut.variables[0].address, "");
  EXPECT_FALSE(sut.variables[1].retain);
  EXPECT_EQ(sut.variables[1].address, "%QW1");
}

TEST(ExportedInstance, HasVariablesWithTheBoundsOfTheirArrays) {
  const std::vector<ListedVariable> variables{
      variable("grid[][]", "ARRAY [1..2, -1..2] OF INT"), variable("label", "STRING[80]", "", "%QX0.1"),
      variable("pump[].blade[][].angle", "ARRAY [1..4, 0..2, 5..6] OF REAL"),
      variable("pump[].hours[]", "ARRAY [1..4, 0..9] OF STRING[8]"), variable("odd[]", "ARRAY of nothing")};
  std::vector<std::string> found;
  for (const auto& one : exported_instance("line1", {}, variables).variables)
    found.push_back(one.path + " " + one.address + ": " + one.type);
  EXPECT_THAT(found, ElementsAre("grid : ARRAY [1..2, -1..2] OF INT", "label %QX0.1: STRING[80]",
                                 "pump[1..4].blade[0..2, 5..6].angle : REAL",
                                 "pump[1..4].hours : ARRAY [0..9] OF STRING[8]", " : "));
}

// Of a later version: a type is a text, so a client shows each.
TEST(ExportedInstance, HasTypesThatItDoesNotKnow) {
  const auto sut = exported_instance("line1", {}, std::vector<ListedVariable>{variable("a", "XCHAR[8]")});
  EXPECT_EQ(sut.variables.at(0).type, "XCHAR[8]");
}

// A length that a compiler gives to all texts without one is none.
TEST(ExportedInstance, HasTextsWithTheLengthsThatTheyWereGiven) {
  const auto types_of = [](const std::vector<ListedVariable>& variables) {
    std::vector<std::string> types;
    for (const auto& one : exported_instance("line1", {}, variables).variables) types.push_back(one.type);
    return types;
  };
  EXPECT_THAT(
      types_of({variable("a", "STRING[20]"), variable("b", "STRING[254]"), variable("c", "STRING[126]")}),
      ElementsAre("STRING[20]", "STRING", "STRING[126]"));
  EXPECT_THAT(types_of({variable("a", "WSTRING[20]"), variable("b[]", "ARRAY [1..2] OF WSTRING[254]")}),
              ElementsAre("WSTRING[20]", "ARRAY [1..2] OF WSTRING"));
  const ListedVariable program = variable("one", "STRING[6]", "fast", "program");
  EXPECT_THAT(
      types_of({program, variable("a[]", "ARRAY [1..2] OF STRING[126]"), variable("b", "STRING[126]")}),
      ElementsAre("ARRAY [1..2] OF STRING", "STRING"))
      << "of MATIEC";
}

}  // namespace
}  // namespace plchost
