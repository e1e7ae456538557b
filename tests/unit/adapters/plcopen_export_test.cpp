// The reader of PLCopen XML understands the files that an export writes.
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/plcopen/structured_text.hpp"
#include "instances/adapters/plcopen/write_project.hpp"

namespace plchost::plcopen {
namespace {

using Kind = ExportedTask::Kind;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

ExportedInstance line() {
  return {
      .name = "line1",
      .tasks = {{.name = "fast", .kind = Kind::cyclic, .priority = 1, .interval_ns = 250'000, .event = ""},
                {.name = "edge", .kind = Kind::event, .priority = 0, .interval_ns = 0, .event = "go"},
                {.name = "done", .kind = Kind::external, .priority = 2, .interval_ns = 0, .event = "product"},
                {.name = "rest", .kind = Kind::freewheeling, .priority = 31, .interval_ns = 0, .event = ""}},
      .programs = {{.name = "main", .type = "Main", .task = "FAST"},
                   {.name = "halt", .type = "Halt", .task = "edge"},
                   {.name = "rest", .type = "Rest", .task = ""}},
      .variables = {{.path = "go", .type = "BOOL", .address = "%IX0.0"},
                    {.path = "limit", .type = "INT", .address = "", .constant = true},
                    {.path = "MAIN.COUNT", .type = "DINT", .address = "", .retain = true},
                    {.path = "MAIN.NAMES", .type = "ARRAY[1..3, 0..1] OF STRING(80)", .address = ""},
                    {.path = "MAIN.SPEED", .type = "INT (-5..5)", .address = "%QW1"},
                    {.path = "MAIN.PUMP", .type = "Pump", .address = ""},
                    {.path = "MAIN.TIMER.IN", .type = "BOOL", .address = ""},
                    {.path = "MAIN.TIMER.ET", .type = "TIME", .address = ""}}};
}

ExportedPlant plant_of(std::vector<ExportedInstance> instances) {
  return {.product_version = "1", .time = "2026-01-31T12:00:00", .hosts = {{"cell1", std::move(instances)}}};
}

/// As a build reads it. That its POUs have no bodies is all that is wrong with it.
iec::Project read_again(const std::string& xml) {
  const StructuredText read = structured_text_of({"plant.xml", xml});
  for (const auto& problem : read.problems) EXPECT_THAT(problem.text, HasSubstr("it has no body"));
  const std::vector<iec::Source> sources{{"plant.xml", read.text.text()}};
  auto [project, problems] = iec::read_project(sources);
  EXPECT_THAT(problems, IsEmpty()) << read.text.text();
  return project;
}

TEST(PlcopenExport, HasTasksProgramsAndVariablesThatTheBuildReads) {
  const iec::Project project = read_again(project_of(plant_of({line()})));
  ASSERT_EQ(project.configurations.size(), 1U);
  EXPECT_EQ(project.configurations[0].name, "cell1");
  ASSERT_EQ(project.configurations[0].resources.size(), 1U);
  const iec::Resource& resource = project.configurations[0].resources[0];
  EXPECT_EQ(resource.name, "line1");
  ASSERT_EQ(resource.tasks.size(), 3U);
  EXPECT_EQ(resource.tasks[0].interval_ns, 250'000);
  EXPECT_EQ(resource.tasks[0].priority, 1);
  EXPECT_EQ(resource.tasks[1].single, "go");
  EXPECT_EQ(resource.tasks[2].name, "done");
  ASSERT_EQ(resource.programs.size(), 3U);
  EXPECT_EQ(resource.programs[0].type, "Main");
  EXPECT_EQ(resource.programs[0].task, "fast");
  EXPECT_EQ(resource.programs[2].task, "") << "it is freewheeling";
  ASSERT_EQ(resource.globals.size(), 2U);
  EXPECT_EQ(resource.globals[0].location, "%IX0.0");
  EXPECT_TRUE(resource.globals[1].constant);
  const iec::Pou* const main = project.pou("Main");
  ASSERT_NE(main, nullptr);
  std::vector<std::string> declarations;
  for (const iec::Variable& variable : main->variables) {
    declarations.push_back(variable.name + " " + variable.location + ": " + variable.type +
                           (variable.retain ? ", retained" : ""));
  }
  EXPECT_THAT(declarations, ElementsAre("NAMES : ARRAY[1..3, 0..1] OF STRING[80]", "SPEED %QW1: INT(- 5..5)",
                                        "PUMP : Pump", "TIMER : TIMER_type", "COUNT : DINT, retained"));
  ASSERT_EQ(project.types.size(), 1U);
  EXPECT_EQ(project.types[0].definition, "TIMER_TYPE : STRUCT IN : BOOL ; ET : TIME ; END_STRUCT ; ");
}

TEST(PlcopenExport, TellsWhatStHasNoWordsFor) {
  const std::string xml = project_of(plant_of({line()}));
  EXPECT_THAT(xml, HasSubstr("the external event product runs it"));
  ExportedInstance other{.name = "line-2.b", .tasks = {}, .programs = {}, .variables = {}};
  other.tasks = {{.name = "a b", .kind = Kind::freewheeling, .priority = 31, .interval_ns = 0, .event = ""},
                 {.name = "a_b", .kind = Kind::event, .priority = 3, .interval_ns = 0, .event = ""}};
  const std::string renamed = project_of(plant_of({line(), other}));
  EXPECT_THAT(renamed, HasSubstr("it is freewheeling; its name in plchost is a b"));
  EXPECT_THAT(renamed, HasSubstr("it runs at each rising edge of a variable; its name in plchost is a_b"));
  const iec::Project project = read_again(renamed);
  ASSERT_EQ(project.configurations.at(0).resources.size(), 2U);
  EXPECT_EQ(project.configurations[0].resources[1].name, "line_2_b");
  EXPECT_EQ(project.configurations[0].resources[1].tasks.at(1).name, "a_b_2");
}

TEST(PlcopenExport, TellsProgramsOfOneNameApartIfTheirVariablesAre) {
  ExportedInstance same = line();
  same.name = "line2";
  ExportedInstance other = line();
  other.name = "line3";
  other.variables.push_back({.path = "MAIN.MORE", .type = "INT", .address = ""});
  const iec::Project project = read_again(project_of(plant_of({line(), same, other})));
  const auto& resources = project.configurations.at(0).resources;
  ASSERT_EQ(resources.size(), 3U);
  EXPECT_EQ(resources[1].programs.at(0).type, "Main");
  EXPECT_EQ(resources[2].programs.at(0).type, "Main_2");
}

TEST(PlcopenExport, IsXmlWhateverTheNamesAre) {
  ExportedInstance odd{.name = "<a&\"b\">\x01", .tasks = {}, .programs = {}, .variables = {}};
  odd.tasks = {{.name = "<&>", .kind = Kind::external, .priority = 1, .interval_ns = 0, .event = "\x02<"}};
  for (int depth = 0; depth < 100; ++depth)
    odd.variables.push_back(
        {.path = std::string(static_cast<std::size_t>(depth), '.') + "<x>", .type = "<", .address = ""});
  const std::string xml =
      project_of(plant_of({odd, {.name = "", .tasks = {}, .programs = {}, .variables = {}}}));
  for (const auto& problem : structured_text_of({"plant.xml", xml}).problems)
    EXPECT_THAT(problem.text, Not(HasSubstr("no XML")));
  EXPECT_THAT(xml, Not(HasSubstr("\x01")));
}

}  // namespace
}  // namespace plchost::plcopen
