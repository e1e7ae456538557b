#include "instances/adapters/iec/project.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "instances/adapters/iec/task_plan.hpp"
#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost::iec {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr std::string_view kLine = R"(
FUNCTION_BLOCK Valve
  VAR_INPUT open : BOOL; END_VAR
  VAR lamp AT %QX0.1 : BOOL; END_VAR
  lamp := open;
END_FUNCTION_BLOCK

PROGRAM Main
  VAR RETAIN count, total : DINT := 5; END_VAR
  VAR_EXTERNAL go : BOOL; END_VAR
  VAR
    raw AT %IW2 : ARRAY [1..4] OF INT := [1, 2, 3, 4];
    text : STRING[80] := 'PROGRAM; END_VAR';
    valve : Valve;
  END_VAR
  IF go THEN count := count + 1; END_IF;
END_PROGRAM

CONFIGURATION cell
  VAR_GLOBAL go AT %IX0.0 : BOOL; END_VAR
  RESOURCE press ON PLC
    VAR_GLOBAL CONSTANT limit : INT := 3; END_VAR
    TASK fast (INTERVAL := T#10ms, PRIORITY := 1);
    TASK edge (SINGLE := go, PRIORITY := 0);
    PROGRAM RETAIN main1 WITH fast : Main;
    PROGRAM main2 : Main (go := go);
  END_RESOURCE
END_CONFIGURATION
)";

ReadProject read(std::string_view text) {
  const std::vector<Source> sources{{"a.st", std::string(text)}};
  return read_project(sources);
}
std::vector<std::string> problems_of(std::string_view text) {
  return texts(read(text).problems);
}
std::string in_resource(const std::string& text) {
  return "CONFIGURATION c RESOURCE r ON PLC\n" + text + "\nEND_RESOURCE END_CONFIGURATION";
}

TEST(IecProject, HasTheTasksOfAResourceWithTheirPrograms) {
  const auto [project, problems] = read(kLine);
  EXPECT_THAT(problems, IsEmpty());
  ASSERT_THAT(project.configurations, SizeIs(1));
  const Configuration& cell = project.configurations.front();
  EXPECT_EQ(cell.name, "cell");
  ASSERT_THAT(cell.resources, SizeIs(1));
  const Resource& press = cell.resources.front();
  ASSERT_THAT(press.tasks, SizeIs(2));
  EXPECT_EQ(press.tasks[0].name, "fast");
  EXPECT_EQ(press.tasks[0].interval_ns, 10'000'000);
  EXPECT_EQ(press.tasks[0].priority, 1);
  EXPECT_EQ(press.tasks[1].single, "go");
  EXPECT_EQ(press.tasks[1].interval_ns, std::nullopt);
  ASSERT_THAT(press.programs, SizeIs(2));
  EXPECT_EQ(press.programs[0].task, "fast");
  EXPECT_EQ(press.programs[0].type, "Main");
  EXPECT_EQ(press.programs[1].name, "main2");
  EXPECT_EQ(press.programs[1].task, "");
  EXPECT_TRUE(press.globals.at(0).constant);
}

TEST(IecProject, HasTheVariablesOfEachPou) {
  const Project project = read(kLine).project;
  const Pou* const main = project.pou("MAIN");
  ASSERT_NE(main, nullptr);
  ASSERT_THAT(main->variables, SizeIs(6));
  EXPECT_EQ(main->variables[0].name, "count");
  EXPECT_TRUE(main->variables[1].retain);
  EXPECT_EQ(main->variables[1].type, "DINT");
  EXPECT_EQ(main->variables[2].section, Variable::Section::external);
  EXPECT_EQ(main->variables[3].location, "%IW2");
  EXPECT_EQ(main->variables[3].type, "ARRAY[1..4] OF INT");
  EXPECT_EQ(main->variables[4].type, "STRING[80]");
  EXPECT_EQ(project.pou("valve")->kind, Pou::Kind::function_block);
  EXPECT_EQ(project.configurations.front().globals.at(0).location, "%IX0.0");
}

TEST(IecProject, MayHaveItsTasksInTheConfigurationItself) {
  const auto [project, problems] = read(
      "CONFIGURATION c TASK t (INTERVAL := T#1s, PRIORITY := 3); PROGRAM p WITH t : Main; END_CONFIGURATION");
  EXPECT_THAT(problems, IsEmpty());
  ASSERT_THAT(project.configurations.at(0).resources, SizeIs(1));
  EXPECT_EQ(project.configurations[0].resources[0].name, "");
  EXPECT_EQ(project.configurations[0].resources[0].programs.at(0).task, "t");
}

TEST(IecProject, SaysWhatIsWrongWithATask) {
  EXPECT_THAT(problems_of(in_resource("TASK t (INTERVAL := T#1s);")),
              ElementsAre("a.st:2:1: TASK t has no PRIORITY; 0 to 31 is allowed"));
  EXPECT_THAT(problems_of(in_resource("TASK t (INTERVAL := 20, PRIORITY := 1);")).at(0),
              HasSubstr("a.st:2:21: INTERVAL '20' is not a duration"));
  EXPECT_THAT(problems_of(in_resource("TASK t (INTERVAL := T#1s, PRIORITY := 32);")),
              ElementsAre("a.st:2:39: PRIORITY 32: allowed is 0 (the highest) to 31"));
  EXPECT_THAT(problems_of(in_resource("TASK t (SINGLE := 'a', PRIORITY := 1);")),
              ElementsAre("a.st:2:19: SINGLE 'a': allowed is the name of a variable"));
  EXPECT_THAT(problems_of(in_resource("TASK t (INTERVL := T#1s, PRIORITY := 1);")).at(0),
              HasSubstr("'INTERVL' is no part of a TASK"));
  EXPECT_THAT(
      problems_of(in_resource("TASK t (SINGLE := a, PRIORITY := 1); TASK T (SINGLE := a, PRIORITY := 1);")),
      ElementsAre("a.st:2:38: there are two TASKs 'T'"));
}

TEST(IecProject, SaysWhichTaskOfAProgramIsMissing) {
  EXPECT_THAT(problems_of(in_resource("PROGRAM p WITH slow : Main;")),
              ElementsAre("a.st:2:1: PROGRAM p runs WITH 'slow', and there is no such TASK in its resource"));
}

TEST(IecProject, NamesTwoPousOfOneName) {
  EXPECT_THAT(problems_of("PROGRAM a END_PROGRAM\nFUNCTION_BLOCK A END_FUNCTION_BLOCK"),
              ElementsAre("a.st:2:1: there are two POUs 'A'"));
}

TEST(IecProject, WithTwoDeclarationsOfOneNameIsNotPlanned) {
  const auto [project, problems] = read(
      "TYPE Mode : (idle, busy); END_TYPE\nTYPE mode : INT; END_TYPE\n"
      "FUNCTION_BLOCK MODE END_FUNCTION_BLOCK\nPROGRAM Main END_PROGRAM\n" +
      in_resource("TASK t (INTERVAL := T#1s, PRIORITY := 1); PROGRAM p WITH t : Main;"));
  ASSERT_THAT(problems, IsEmpty());
  for (const Compiler compiler : {Compiler::matiec, Compiler::strucpp}) {
    const Configuration& configuration = project.configurations.at(0);
    const TaskPlan plan = plan_tasks(project, configuration, configuration.resources.at(0), compiler);
    EXPECT_THAT(texts(plan.problems),
                ElementsAre("a.st:2:6: 'mode' is the name of a TYPE, too: call one of them otherwise",
                            "a.st:3:1: 'MODE' is the name of a TYPE, too: call one of them otherwise"));
  }
}

TEST(IecProject, KnowsPersistentFromAVariableOfThatName) {
  const auto [project, problems] = read(
      "PROGRAM p VAR RETAIN PERSISTENT a : INT; END_VAR VAR persistent : INT; END_VAR "
      "VAR persistent, b : INT; END_VAR VAR persistent AT %QW1 : INT; END_VAR END_PROGRAM");
  EXPECT_THAT(problems, IsEmpty());
  EXPECT_THAT(project.persistent, SizeIs(1));
  const std::vector<Variable>& variables = project.pou("p")->variables;
  ASSERT_THAT(variables, SizeIs(5));
  EXPECT_TRUE(variables[0].retain);
  EXPECT_EQ(variables[1].name + variables[2].name + variables[3].name, "persistentpersistentb");
  EXPECT_EQ(variables[4].location, "%QW1");
}

TEST(IecProject, RefusesSectionsOfWhichACompilerKeepsNothing) {
  const std::string begin = "CONFIGURATION c RESOURCE r ON PLC END_RESOURCE\n ";
  EXPECT_THAT(
      problems_of(begin + "VAR_CONFIG r.i.a : INT := 77; END_VAR END_CONFIGURATION"),
      ElementsAre("a.st:2:2: VAR_CONFIG is not carried out; write the initial value, or the location, "
                  "where the variable is declared, and remove this section"));
  EXPECT_THAT(problems_of(begin + "VAR_ACCESS a : r.i.a : INT READ_ONLY; END_VAR END_CONFIGURATION"),
              ElementsAre("a.st:2:2: VAR_ACCESS is not carried out; remove this section, as clients see "
                          "the variables of programs, and globals, by their own names"));
}

// Each cut of a text, and each word left out: it comes to an end, and says nothing of a place outside.
TEST(IecProject, ComesToAnEndWithAnyText) {
  for (std::size_t length = 0; length <= kLine.size(); ++length) {
    for (const SourceProblem& problem : read(kLine.substr(0, length)).problems) {
      EXPECT_EQ(problem.place.file, "a.st");
      EXPECT_GE(problem.place.line, 1U);
    }
  }
  for (const char* const text :
       {"CONFIGURATION", "CONFIGURATION c RESOURCE", "PROGRAM p VAR a : ; b", "VAR", "PROGRAM p VAR : : AT ,",
        "CONFIGURATION c TASK (", "PROGRAM p VAR PERSISTENT", "CONFIGURATION c ) ( END_RESOURCE", "%", "{",
        "'", "T#"}) {
    (void)read(text);
  }
}

}  // namespace
}  // namespace plchost::iec
