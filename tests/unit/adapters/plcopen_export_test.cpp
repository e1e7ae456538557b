// The reader of PLCopen XML understands the files that an export writes.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/task_file.hpp"
#include "instances/adapters/plcopen/structured_text.hpp"
#include "instances/adapters/plcopen/write_project.hpp"
#include "instances/adapters/run_program.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::plcopen {
namespace {

using Kind = ExportedTask::Kind;
using testing::AnyOf;
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

/// As a build reads it.
iec::Project read_again(const std::string& xml) {
  ProjectSources sut;
  iec::SourceProblems problems;
  iec::SourceProblems remarks;
  const std::vector<iec::Source> sources{sut.take({"plant.xml", xml}, problems)};
  EXPECT_THAT(problems, IsEmpty());
  sut.restore(problems, remarks);
  EXPECT_FALSE(remarks.empty());
  for (const auto& remark : remarks)
    EXPECT_THAT(remark.text,
                AnyOf(HasSubstr("its body has no statement"), HasSubstr("ST cannot tell the two apart")));
  auto [project, wrong] = iec::read_project(sources);
  EXPECT_THAT(wrong, IsEmpty()) << sources.front().text;
  for (iec::Configuration& configuration : project.configurations) sut.add_events(configuration);
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
  EXPECT_EQ(resource.tasks[2].extension.external_event, "product");
  EXPECT_EQ(resource.tasks[0].extension.external_event, "");
  ASSERT_EQ(resource.programs.size(), 3U);
  EXPECT_EQ(resource.programs[0].type, "Main");
  EXPECT_EQ(resource.programs[0].task, "fast");
  EXPECT_EQ(resource.programs[2].task, "") << "it is freewheeling";
  const std::vector<iec::Variable>& globals = project.configurations[0].globals;
  ASSERT_EQ(globals.size(), 2U);
  EXPECT_TRUE(globals[0].constant);
  EXPECT_EQ(globals[1].location, "%IX0.0");
  const iec::Pou* const main = project.pou("Main");
  ASSERT_NE(main, nullptr);
  std::vector<std::string> declarations;
  for (const iec::Variable& variable : main->variables) {
    declarations.push_back(variable.name + " " + variable.location + ": " + variable.type +
                           (variable.retain ? ", retained" : ""));
  }
  EXPECT_THAT(declarations,
              ElementsAre("NAMES : ARRAY[1..3, 0..1] OF STRING[80]", "PUMP : Pump", "TIMER : TIMER_type",
                          "COUNT : DINT, retained", "SPEED %QW1: INT(- 5..5)"));
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
  EXPECT_THAT(renamed,
              HasSubstr("it runs at each rising edge of a variable, whose name plchost does not know; its "
                        "name in plchost is a_b"));
  const iec::Project project = read_again(renamed);
  ASSERT_EQ(project.configurations.at(0).resources.size(), 2U);
  EXPECT_EQ(project.configurations[0].resources[1].name, "line_2_b");
  const iec::Resource& resource = project.configurations[0].resources[1];
  EXPECT_EQ(resource.tasks.at(1).name, "a_b_2");
  EXPECT_EQ(resource.tasks[1].single, "edge_of_a_b_2");
  ASSERT_EQ(resource.globals.size(), 1U);
  EXPECT_EQ(resource.globals[0].name + resource.globals[0].type, "edge_of_a_b_2BOOL");
}

TEST(PlcopenExport, ChangesNamesThatAreWordsOfSt) {
  ExportedInstance one{.name = "Resource", .tasks = {}, .programs = {}, .variables = {}};
  one.tasks = {{.name = "if", .kind = Kind::cyclic, .priority = 1, .interval_ns = 1'000'000, .event = ""}};
  one.programs = {{.name = "Step", .type = "Function", .task = "if"}};
  one.variables = {{.path = "at", .type = "BOOL", .address = ""},
                   {.path = "_At", .type = "BOOL", .address = ""},
                   {.path = "pump.int", .type = "INT", .address = ""},
                   {.path = "pump.a__b_", .type = "INT", .address = ""},
                   {.path = "pump.IN", .type = "INT", .address = ""},
                   {.path = "Step.end_if", .type = "INT", .address = ""},
                   {.path = "Step.end_iff", .type = "Type", .address = ""}};
  const std::string xml = project_of(plant_of({one}));
  for (const char* const name : {"Resource", "if", "Step", "Function", "at", "int", "end_if", "a__b_"})
    EXPECT_THAT(xml, HasSubstr(std::string("its name in plchost is ") + name + "<"));
  const iec::Project project = read_again(xml);
  const iec::Resource& resource = project.configurations.at(0).resources.at(0);
  EXPECT_EQ(resource.name, "_Resource");
  EXPECT_EQ(resource.tasks.at(0).name, "_if");
  EXPECT_EQ(resource.programs.at(0).name + resource.programs[0].type, "_Step_Function");
  std::vector<std::string> declared;
  for (const iec::Variable& variable : project.configurations[0].globals)
    declared.push_back(variable.name + ": " + variable.type);
  for (const iec::Variable& variable : project.pou("_Function")->variables)
    declared.push_back(variable.name + ": " + variable.type);
  EXPECT_THAT(declared,
              ElementsAre("_at: BOOL", "_At_2: BOOL", "pump: pump_type", "_end_if: INT", "end_iff: _Type"));
  ASSERT_EQ(project.types.size(), 1U);
  EXPECT_EQ(project.types[0].definition,
            "PUMP_TYPE : STRUCT _INT : INT ; A_B : INT ; IN : INT ; END_STRUCT ; ");
}

TEST(PlcopenExport, HasArraysOfStructuresAndAddressesThatStAllows) {
  ExportedInstance one{.name = "line1", .tasks = {}, .programs = {}, .variables = {}};
  one.variables = {{.path = "lamp", .type = "BOOL", .address = "%QX0.1"},
                   {.path = "odd", .type = "INT", .address = "DB1.4"},
                   {.path = "pump[1..4].hours", .type = "ARRAY [0..2] OF INT", .address = "%IW4"},
                   {.path = "PUMP[1..4].speed", .type = "REAL", .address = ""},
                   {.path = "pump2", .type = "INT", .address = ""},
                   {.path = "pump2.more", .type = "INT", .address = ""}};
  one.tasks = {{.name = "fast", .kind = Kind::cyclic, .priority = 1, .interval_ns = 1'000'000, .event = ""}};
  one.programs = {{.name = "main", .type = "Main", .task = "fast"}};
  one.variables.push_back({.path = "valve.strokes", .type = "DINT", .address = "", .retain = true});
  const std::string xml = project_of(plant_of({one}));
  EXPECT_THAT(xml, HasSubstr("it is retained"));
  EXPECT_THAT(xml, HasSubstr("it lies at DB1.4"));
  EXPECT_THAT(xml, HasSubstr("it lies at %IW4"));
  const iec::Project project = read_again(xml);
  std::vector<std::string> globals;
  for (const iec::Variable& variable : project.configurations.at(0).globals)
    globals.push_back(variable.name + " " + variable.location + ": " + variable.type);
  EXPECT_THAT(globals, ElementsAre("pump : ARRAY[1..4] OF pump_type", "pump2 : INT", "pump2_2 : pump2_2_type",
                                   "valve : valve_type", "lamp %QX0.1: BOOL", "odd : INT"));
  ASSERT_EQ(project.types.size(), 3U);
  EXPECT_EQ(project.types[0].definition,
            "PUMP_TYPE : STRUCT HOURS : ARRAY [ 0 .. 2 ] OF INT ; SPEED : REAL ; END_STRUCT ; ");
}

TEST(PlcopenExport, TellsAVariableFromAProgramOfItsName) {
  ExportedInstance one{.name = "line1", .tasks = {}, .programs = {}, .variables = {}};
  one.variables = {{.path = "main", .type = "INT", .address = ""},
                   {.path = "main.speed", .type = "REAL", .address = ""}};
  one.tasks = {{.name = "fast", .kind = Kind::cyclic, .priority = 1, .interval_ns = 1'000'000, .event = ""}};
  one.programs = {{.name = "main", .type = "Main", .task = "fast"}};
  const iec::Project project = read_again(project_of(plant_of({one})));
  const std::vector<iec::Variable>& globals = project.configurations.at(0).globals;
  ASSERT_EQ(globals.size(), 1U);
  EXPECT_EQ(globals[0].name + globals[0].type, "mainINT");
  ASSERT_EQ(project.pou("Main")->variables.size(), 1U);
  EXPECT_EQ(project.pou("Main")->variables[0].name, "speed");
}

TEST(PlcopenExport, KeepsAnEventBesideOtherOptionsOfATaskFile) {
  const auto event_with = [](const std::string& task_file) {
    ProjectSources sut;
    iec::SourceProblems problems;
    const std::vector<iec::Source> sources{sut.take({"plant.xml", project_of(plant_of({line()}))}, problems)};
    EXPECT_THAT(problems, IsEmpty());
    iec::Configuration configuration = iec::read_project(sources).project.configurations.at(0);
    EXPECT_THAT(iec::read_task_file({"plant.toml", task_file}, configuration), IsEmpty());
    sut.add_events(configuration);
    return configuration.resources.at(0).tasks.at(2).extension.external_event;
  };
  EXPECT_EQ(event_with(""), "product");
  EXPECT_EQ(event_with("[task.done]\nwatchdog_time = '5ms'\n"), "product");
  EXPECT_EQ(event_with("[task.done]\nexternal_event = 'other'\n"), "other");
}

TEST(PlcopenExport, RefusesAnEventWhoseNameIsNone) {
  std::string xml = project_of(plant_of({line()}));
  xml.replace(xml.find("external_event=\"product\""), 24, "external_event=\"a b\"");
  const StructuredText read = structured_text_of({"plant.xml", xml});
  ASSERT_EQ(read.problems.size(), 1U);
  EXPECT_THAT(read.problems[0].text, HasSubstr("task done: the name of an event"));
  EXPECT_THAT(read.text.events(), IsEmpty());
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

// The schema is PLCopen's, and no part of this repository.
TEST(PlcopenSchema, HoldsForWhatIsExported) {
  const char* const schema = std::getenv("PLCHOST_TC6_XSD");  // NOLINT(concurrency-mt-unsafe)
  if (schema == nullptr || *schema == '\0') GTEST_SKIP() << "needs the schema of PLCopen (PLCHOST_TC6_XSD)";
  ExportedInstance other{.name = "<line 2>", .tasks = {}, .programs = {}, .variables = {}};
  other.tasks = {{.name = "a b", .kind = Kind::freewheeling, .priority = 31, .interval_ns = 0, .event = ""},
                 {.name = "a_b", .kind = Kind::event, .priority = 3, .interval_ns = 0, .event = ""},
                 {.name = "<&>", .kind = Kind::external, .priority = 1, .interval_ns = 0, .event = "\x02<"}};
  other.programs = {{.name = "a b", .type = "A", .task = ""}, {.name = "two", .type = "A", .task = "a_b"}};
  other.variables = {{.path = "odd", .type = "INT", .address = "DB1.4"},
                     {.path = "pump[1..4].hours", .type = "ARRAY [0..2] OF WSTRING(80)", .address = "%IW4"},
                     {.path = "two.limit", .type = "UINT (1..5)", .address = "", .constant = true},
                     {.path = "two.<x>", .type = "<", .address = "", .retain = true}};
  const std::filesystem::path folder = own_path("schema");
  std::filesystem::create_directory(folder);
  for (const auto& plant : {plant_of({}), plant_of({line()}), plant_of({line(), other})}) {
    std::ofstream(folder / "plant.xml") << project_of(plant);
    const auto end = run_program({"xmllint", "--noout", "--schema", schema, "plant.xml"}, folder);
    ASSERT_TRUE(end) << end.error().describe();
    EXPECT_TRUE(end->success()) << end->output;
  }
  std::filesystem::remove_all(folder);
}

// The schema has no element for characters, and none for types of a later version.
TEST(PlcopenExport, HasWideTextsAndNamesOtherTypes) {
  ExportedInstance one{.name = "one", .tasks = {}, .programs = {}, .variables = {}};
  one.variables = {{.path = "title", .type = "WSTRING[80]", .address = ""},
                   {.path = "all", .type = "ARRAY [0..2] OF WSTRING", .address = ""},
                   {.path = "letter", .type = "CHAR", .address = ""},
                   {.path = "sign", .type = "WCHAR", .address = ""},
                   {.path = "later", .type = "XCHAR[8]", .address = ""}};
  const std::string xml = project_of(plant_of({one}));
  for (const auto* const part : {R"(<wstring length="80" />)", "<wstring />", R"(<derived name="CHAR" />)",
                                 R"(<derived name="WCHAR" />)", R"(<derived name="XCHAR" />)"})
    EXPECT_THAT(xml, HasSubstr(part));
}

TEST(PlcopenExport, SaysInTheFileWhatItDoesNotHave) {
  EXPECT_THAT(project_of(plant_of({line()})), HasSubstr("<Comment>not exported"));
}

TEST(PlcopenSources, HaveLengthsOfTextsAsTheCompilerKnowsThem) {
  const std::string xml = project_of(plant_of({line()}));
  ProjectSources sut;
  iec::SourceProblems problems;
  std::vector<iec::Source> sources{sut.take({"plant.xml", xml}, problems), {"b.st", "a : STRING[80];"}};
  const std::string before = sources[0].text;
  EXPECT_THAT(before, HasSubstr("NAMES : ARRAY[1..3, 0..1] OF STRING[80];"));
  std::vector<iec::Source> of_matiec = sources;
  sut.fit_lengths(of_matiec, iec::Compiler::matiec);
  EXPECT_THAT(of_matiec[0].text, HasSubstr("NAMES : ARRAY[1..3, 0..1] OF STRING    ;"));
  EXPECT_EQ(of_matiec[0].text.size(), before.size());
  EXPECT_EQ(of_matiec[1].text, "a : STRING[80];") << "as its author wrote it";
  iec::SourceProblems remarks;
  sut.restore(problems, remarks);
  EXPECT_THAT(remarks.back().text, HasSubstr("MATIEC gives each text 126 characters"));
  sut.fit_lengths(sources, iec::Compiler::strucpp);
  EXPECT_THAT(sources[0].text, HasSubstr("NAMES : ARRAY[1..3, 0..1] OF STRING(80);"));
  EXPECT_EQ(sources[0].text.size(), before.size());
  EXPECT_EQ(sources[1].text, "a : STRING[80];") << "as its author wrote it";
}

}  // namespace
}  // namespace plchost::plcopen
