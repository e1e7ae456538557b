#include "instances/adapters/iec/task_file.hpp"

#include <chrono>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost::iec {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kOneResource = R"(
PROGRAM Main END_PROGRAM
CONFIGURATION cell
  RESOURCE press ON PLC
    TASK fast (INTERVAL := T#10ms, PRIORITY := 1);
    TASK edge (SINGLE := go, PRIORITY := 0);
    TASK done (PRIORITY := 2);
    PROGRAM one WITH fast : Main;
    PROGRAM rest : Main;
  END_RESOURCE
END_CONFIGURATION
)";
constexpr const char* kTwoResources = R"(
CONFIGURATION cell
  RESOURCE press ON PLC
    TASK fast (INTERVAL := T#10ms, PRIORITY := 1);
    TASK slow (INTERVAL := T#1s, PRIORITY := 5);
  END_RESOURCE
  RESOURCE robot ON PLC
    TASK fast (INTERVAL := T#20ms, PRIORITY := 1);
  END_RESOURCE
END_CONFIGURATION
)";

constexpr const char* kProgramsOfTwoResources = R"(
CONFIGURATION cell
  RESOURCE press ON PLC PROGRAM one : Main; END_RESOURCE
  RESOURCE robot ON PLC PROGRAM one : Main; END_RESOURCE
END_CONFIGURATION
)";

class TaskFile : public testing::Test {
 protected:
  std::vector<std::string> problems(const std::string& text, const char* program = kOneResource) {
    const std::vector<Source> sources{{"a.st", program}};
    auto [project, found] = read_project(sources);
    EXPECT_TRUE(found.empty()) << describe(found.front());
    configuration = std::move(project.configurations.at(0));
    return texts(read_task_file({"a.toml", text}, configuration));
  }
  const TaskExtension& of(std::size_t task, std::size_t resource = 0) {
    return configuration.resources.at(resource).tasks.at(task).extension;
  }
  Configuration configuration;
};

TEST_F(TaskFile, SetsTheOptionsOfTheTaskThatATableNames) {
  EXPECT_THAT(problems(R"(
[task.FAST]
late_policy = "asap"
start_offset = "250us"
drives_outputs = true
watchdog_time = "5ms"
watchdog_sensitivity = 3
watchdog_omitted_cycles = 10
watchdog_policy = "task"
)"),
              IsEmpty());
  EXPECT_EQ(of(0).external_event, "");
  ASSERT_TRUE(of(0).options);
  EXPECT_EQ(of(0).options->late, LatePolicy::asap);
  EXPECT_EQ(of(0).options->start_offset, 250us);
  EXPECT_TRUE(of(0).options->drives_outputs);
  EXPECT_EQ(of(0).options->watchdog, (TaskWatchdog{5ms, 3, 10, WatchdogPolicy::task}));
  EXPECT_EQ(of(0).place, (SourcePlace{"a.toml", 2, 7}));
  EXPECT_FALSE(of(1).options) << "the file does not name it";
  EXPECT_EQ(of(1).place.line, 0U);
}

TEST_F(TaskFile, LeavesTheDefaultsWhereItSaysNothing) {
  EXPECT_THAT(problems("[task.fast]\nwatchdog_time = \"0s\"\n"), IsEmpty());
  ASSERT_TRUE(of(0).options);
  EXPECT_EQ(of(0).options->watchdog, TaskWatchdog{});
  EXPECT_EQ(of(0).options->late, LatePolicy::next);
  EXPECT_THAT(problems(""), IsEmpty());
  EXPECT_FALSE(of(0).options);
}

TEST_F(TaskFile, NamesTheExternalEventThatRunsATask) {
  EXPECT_THAT(problems("task.done.external_event = 'product'\n[task.rest]\nexternal_event = 'product'\n"
                       "watchdog_time = '1s'\n"),
              IsEmpty());
  EXPECT_EQ(of(2).external_event, "product");
  EXPECT_FALSE(of(2).options);
  const TaskExtension& rest = configuration.resources.at(0).programs.at(1).extension;
  EXPECT_EQ(rest.external_event, "product") << "a program without a task is a task of its own";
  EXPECT_TRUE(rest.options);
  EXPECT_THAT(problems("[task.fast]\nexternal_event = 'line2/product'"),
              ElementsAre(HasSubstr("a.toml:2:1: task fast external_event: ")));
  EXPECT_THAT(problems("[task.fast]\nexternal_event = ''"), ElementsAre(HasSubstr("external_event: ")));
}

TEST_F(TaskFile, TellsTasksOfSeveralResourcesApart) {
  EXPECT_THAT(problems("[resource.Robot.task.fast]\nstart_offset = '15ms'\n[task.slow]\nstart_offset = '1ms'",
                       kTwoResources),
              IsEmpty());
  EXPECT_FALSE(of(0).options);
  EXPECT_EQ(of(0, 1).options->start_offset, 15ms);
  EXPECT_EQ(of(1).options->start_offset, 1ms) << "only one resource has a task of this name";
  EXPECT_THAT(problems("[task.fast]\n", kTwoResources),
              ElementsAre("a.toml:1:7: the resources press and robot have a task fast; write "
                          "[resource.press.task.fast]"));
  EXPECT_THAT(problems("[resource.pres.task.fast]\n[resource.robot.task.slow]", kTwoResources),
              ElementsAre("a.toml:1:11: there is no RESOURCE 'pres'; there are press, robot; did you mean "
                          "'press'?",
                          HasSubstr("there is no task 'slow'; there are fast")));
}

TEST_F(TaskFile, RefusesATaskThatIsNotThereOrThereTwice) {
  EXPECT_THAT(
      problems("[task.fats]"),
      ElementsAre("a.toml:1:7: there is no task 'fats'; there are fast, edge, done, rest; did you mean "
                  "'fast'?"));
  EXPECT_THAT(problems("[task.fast]\n[task.FAST]"), ElementsAre(HasSubstr("the task fast is given in line")));
  EXPECT_THAT(problems("[task.fast]\n[resource.press.task.fast]"),
              ElementsAre(HasSubstr("the task fast is given in line")));
}

TEST_F(TaskFile, RefusesKeysThatItDoesNotKnow) {
  EXPECT_THAT(
      problems("[task.fast]\n  watchdog = '5ms'"),
      ElementsAre(HasSubstr("a.toml:2:3: task fast unknown key 'watchdog'; allowed are external_event, "
                            "late_policy, start_offset, drives_outputs, watchdog_time, ")));
  EXPECT_THAT(
      problems("[tasks.fast]\n[resource.press]\nx = 1"),
      ElementsAre(
          "a.toml:1:2: 'tasks' is not expected here; allowed are scheduler, locations, [location], "
          "[task.NAME], "
          "[program.NAME], [resource.NAME.task.NAME] and [resource.NAME.program.NAME]",
          "a.toml:3:1: 'x' is not expected here; allowed are scheduler, [resource.NAME.task.NAME] and "
          "[resource.NAME.program.NAME]"));
  for (const char* const text : {"scheduler = 'x'", "[resource.press]\nscheduler = 7"}) {
    EXPECT_THAT(problems(text), ElementsAre(HasSubstr("is no scheduler; allowed are CmpSchedule, Cmp")));
  }
  EXPECT_THAT(problems("[task.fast]\nscheduler = 'CmpSchedule'"),
              ElementsAre(HasSubstr("task fast scheduler: one scheduler runs all tasks")));
}

TEST_F(TaskFile, NamesTheSchedulerOfAllResourcesAndOfOne) {
  EXPECT_THAT(problems("scheduler = 'CmpScheduleTimer'\n"), IsEmpty());
  EXPECT_EQ(configuration.resources.front().scheduler, "CmpScheduleTimer");
  EXPECT_THAT(
      problems("scheduler = 'CmpScheduleTimer'\n[resource.press]\nscheduler = 'CmpScheduleOneShot'\n"),
      IsEmpty());
  EXPECT_EQ(configuration.resources.front().scheduler, "CmpScheduleOneShot");
}

TEST_F(TaskFile, PlacesLocations) {
  EXPECT_THAT(problems("locations = 'separate'\n[location]\n'%iw0.0.0.2' = '%iw2'\n\"%QX0.1.2\" = '%Q9'\n"),
              IsEmpty());
  EXPECT_EQ(configuration.locations.widths, Widths::separate);
  const auto& given = configuration.locations.given;
  ASSERT_EQ(given.size(), 2U);
  EXPECT_EQ(given.at(*location_of("%IW0.0.0.2")).location, *location_of("%IW2"));
  EXPECT_EQ(given.at(*location_of("%IW0.0.0.2")).place, (SourcePlace{"a.toml", 3, 1}));
  EXPECT_EQ(given.at(*location_of("%QX0.1.2")).location, *location_of("%QX1.1"));
  EXPECT_THAT(problems("locations = 'shared'"), IsEmpty());
  EXPECT_EQ(configuration.locations.widths, Widths::shared);
}

TEST_F(TaskFile, RefusesWhatPlacesNoLocation) {
  for (const char* const text : {"locations = 'apart'", "locations = true"}) {
    EXPECT_THAT(problems(text), ElementsAre(HasSubstr("is not known; allowed are shared, separate"))) << text;
  }
  EXPECT_THAT(problems("location = 1"), ElementsAre("a.toml:1:1: 1 is no table; write [location]"));
  EXPECT_THAT(problems("[location]\n'%AW0' = '%IW0'\nIW0 = '%IW0'"),
              ElementsAre("a.toml:2:1: '%AW0' is no location; a line of [location] is like \"%IW0.0.0.2\" = "
                          "\"%IW2\"",
                          HasSubstr("a.toml:3:1: 'IW0' is no location")));
  for (const char* const place : {"'%IX0.0'", "'%QW0'", "'%ID0'", "'%IW0.1'", "'IW0'", "''", "7"}) {
    EXPECT_THAT(problems(std::string("[location]\n'%IW0.1.2' = ") + place),
                ElementsAre(testing::AllOf(
                    HasSubstr("a.toml:2:1: location %IW0.1.2: "),
                    HasSubstr("is not allowed; allowed is a place of its area and width, like \"%IW2\""))))
        << place;
  }
  EXPECT_THAT(problems("[location]\n'%Q0.1.2' = '%QB0'"), ElementsAre(HasSubstr("like \"%QX2.0\"")));
  EXPECT_THAT(problems("[location]\n'%IW0.1' = '%IW1'\n'%iw0.1' = '%IW2'"),
              ElementsAre(HasSubstr("the location %IW0.1 is given in line 2, too; remove one of both")));
}

struct Bad {
  const char* line;
  const char* problem;
};
class BadTaskFile : public TaskFile, public testing::WithParamInterface<Bad> {};
TEST_P(BadTaskFile, IsRefusedWithThePlaceAndWhatIsAllowed) {
  EXPECT_THAT(problems(std::string("[task.fast]\n") + GetParam().line),
              ElementsAre(std::string("a.toml:2:") + GetParam().problem));
}
INSTANTIATE_TEST_SUITE_P(
    Lines, BadTaskFile,
    testing::Values(
        Bad{"late_policy = 'soon'",
            "1: task fast late_policy: \"soon\" is not known; allowed are next, asap"},
        Bad{"late_policy = 1", "1: task fast late_policy: 1 is a whole number; allowed is one of next, asap"},
        Bad{"watchdog_policy = 'x'",
            "1: task fast watchdog_policy: \"x\" is not known; allowed are application, task"},
        Bad{"drives_outputs = 1",
            "1: task fast drives_outputs: 1 is a whole number; allowed is true or false"},
        Bad{"watchdog_sensitivity = 0",
            "1: task fast watchdog_sensitivity: 0 is out of range; allowed is 1 to 1000000"},
        Bad{"watchdog_omitted_cycles = 1000001",
            "1: task fast watchdog_omitted_cycles: 1000001 is out of range; allowed is 0 to 1000000"},
        Bad{"watchdog_time = 5",
            "1: task fast watchdog_time: 5 is a whole number; allowed is a duration in quotes, like \"5ms\""},
        Bad{"watchdog_time = '5'",
            "1: task fast watchdog_time: \"5\" is no duration; allowed is \"1ms500us\", "
            "with the units d, h, m, s, ms, us, ns"},
        Bad{"watchdog_time = '-5ms'",
            "1: task fast watchdog_time: \"-5ms\" is out of range; allowed is 0s to "
            "4294967295us in whole microseconds"},
        Bad{"watchdog_time = '1ns'",
            "1: task fast watchdog_time: \"1ns\" is out of range; allowed is 0s to "
            "4294967295us in whole microseconds"},
        Bad{"watchdog_time = '2h'",
            "1: task fast watchdog_time: \"2h\" is out of range; allowed is 0s to "
            "4294967295us in whole microseconds"},
        Bad{"start_offset = '51d'",
            "1: task fast start_offset: \"51d\" is out of range; allowed is 0s to 50d"},
        Bad{"start_offset = '10ms'",
            "1: task fast start_offset: is not below the task's INTERVAL of 10000000 ns"},
        Bad{"fast", "5: 'fast' has no '='; a line is KEY = VALUE or [SECTION]"}));

TEST_F(TaskFile, HasAGridForCyclicTasksOnly) {
  for (const char* const text : {"[task.edge]\nstart_offset = '1ms'", "[task.rest]\nlate_policy = 'asap'",
                                 "[task.fast]\nstart_offset = '1ms'\nexternal_event = 'product'"}) {
    EXPECT_THAT(problems(text), ElementsAre(HasSubstr("a.toml:2:1: ")));
  }
}

TEST_F(TaskFile, RefusesWhatIsNoTable) {
  EXPECT_THAT(problems("task = 1"), ElementsAre("a.toml:1:1: 1 is no table; write [task.NAME]"));
  EXPECT_THAT(problems("[task]\nfast = 1"), ElementsAre("a.toml:2:1: 1 is no table; write [task.NAME]"));
  EXPECT_THAT(problems("[[task.fast]]"), ElementsAre(HasSubstr("is no table")));
  EXPECT_THAT(problems("[resource]\npress = 1"), ElementsAre(HasSubstr("is no table")));
}

TEST_F(TaskFile, TellsABoundedNumberOfProblems) {
  std::string text;
  for (int i = 0; i < 1000; ++i) text += "[task.x" + std::to_string(i) + "]\n";
  EXPECT_EQ(problems(text).size(), 100U);
}

TEST_F(TaskFile, GivesAProgramCopiesOfItsGlobals) {
  EXPECT_THAT(problems("[program.ONE]\nglobals = 'copy'\n[program.rest]\nglobals = 'shared'"), IsEmpty());
  const std::vector<Program>& programs = configuration.resources.at(0).programs;
  EXPECT_TRUE(programs.at(0).copies_globals);
  EXPECT_FALSE(programs.at(1).copies_globals);
  EXPECT_THAT(problems("[resource.robot.program.one]\nglobals = 'copy'", kProgramsOfTwoResources), IsEmpty());
  EXPECT_FALSE(configuration.resources.at(0).programs.at(0).copies_globals);
  EXPECT_TRUE(configuration.resources.at(1).programs.at(0).copies_globals);
}

TEST_F(TaskFile, RefusesWhatIsNoOptionOfAProgram) {
  EXPECT_THAT(problems("[program.one]\nglobals = 'copy'\n[program.One]\nglobals = 'shared'"),
              ElementsAre(HasSubstr("the program one is given in line")));
  EXPECT_THAT(problems("[program.on]\nglobals = 'copy'"),
              ElementsAre("a.toml:1:10: there is no program 'on'; there are one, rest; did you mean 'one'?"));
  EXPECT_THAT(problems("[program.one]\nglobals = 'own'\nglobal = 'copy'"),
              ElementsAre(HasSubstr("a.toml:2:"), HasSubstr("program one unknown key 'global'")));
  EXPECT_THAT(problems("[program]\none = 'copy'"),
              ElementsAre(HasSubstr("is no table; write [program.NAME]")));
  EXPECT_THAT(problems("[program.one]\nglobals = 'copy'", kProgramsOfTwoResources),
              ElementsAre(HasSubstr("the resources press and robot have a program one; write "
                                    "[resource.press.program.one]")));
}

}  // namespace
}  // namespace plchost::iec
