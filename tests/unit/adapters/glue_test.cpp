#include "instances/adapters/matiec/glue.hpp"

#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "instances/adapters/iec/task_file.hpp"
#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost::matiec {
namespace {

using iec::Glue;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class MatiecGlue : public testing::Test {
 protected:
  Glue write(const std::string& programs, const std::string& globals, const std::string& resource,
             const std::vector<Located>& located = {}, const std::string& task_file = "") {
    const std::vector<iec::Source> sources{
        {"a.st", programs},
        {"c.st", "CONFIGURATION cell\n" + globals + "\nRESOURCE press ON PLC\n" + resource +
                     "\nEND_RESOURCE END_CONFIGURATION"}};
    auto [project, problems] = iec::read_project(sources);
    EXPECT_THAT(texts(problems), IsEmpty());
    iec::Configuration& configuration = project.configurations.at(0);
    EXPECT_THAT(texts(iec::read_task_file({"c.toml", task_file}, configuration)), IsEmpty());
    return write_glue(project, configuration, configuration.resources.at(0), located);
  }
  static constexpr const char* kMain =
      "PROGRAM Main VAR_EXTERNAL go : BOOL; END_VAR VAR raw AT %IW2 : INT; END_VAR END_PROGRAM";
  static constexpr const char* kGo = "VAR_GLOBAL go : BOOL; END_VAR";
  static constexpr const char* kIdle = "TASK idle (INTERVAL := T#1s, PRIORITY := 31); ";
  static constexpr const char* kFast = "TASK fast (INTERVAL := T#10ms, PRIORITY := 1);";
};

TEST_F(MatiecGlue, RunsTheProgramsOfATaskInTheirOrder) {
  const Glue glue =
      write(kMain, kGo, std::string(kFast) + "PROGRAM one WITH fast : Main; PROGRAM two WITH fast : Main;");
  EXPECT_THAT(texts(glue.problems), IsEmpty());
  EXPECT_THAT(
      glue.text,
      HasSubstr(
          "plchost_begin(0);\n  MAIN_body__(&PRESS__ONE);\n  MAIN_body__(&PRESS__TWO);\n  plchost_end(0);"));
  EXPECT_THAT(glue.text, HasSubstr("{\"fast\", 1, 10000000L, 0, plchost_run_0,"));
}

TEST_F(MatiecGlue, GivesATaskThePlacesThatItsProgramsUse) {
  const std::string other = " PROGRAM Other VAR lamp AT %QX0.1 : BOOL; END_VAR END_PROGRAM";
  const Glue glue =
      write(std::string(kMain) + other, "VAR_GLOBAL go AT %IX0.0 : BOOL; END_VAR",
            std::string(kFast) +
                "TASK slow (INTERVAL := T#1s, PRIORITY := 5);"
                "PROGRAM one WITH fast : Main; PROGRAM two WITH slow : Other;",
            {{"INT", "__IW2", "%IW2"}, {"BOOL", "__QX0_1", "%QX0.1"}, {"BOOL", "__IX0_0", "%IX0.0"}});
  EXPECT_THAT(texts(glue.problems), IsEmpty());
  EXPECT_THAT(
      glue.text,
      HasSubstr(
          "plchost_uses_0[] = {\n  {0, &plchost_value_0, 0, 0},\n  {2, &plchost_value_2, 0, 0},\n  {0}}"));
  EXPECT_THAT(glue.text, HasSubstr("plchost_uses_1[] = {\n  {1, &plchost_value_1, 0, 0},\n  {0}}"));
  EXPECT_THAT(glue.text, HasSubstr("{\"__IW2\", 'I', 2, -1, 0, 4u, &plchost_value_0}"));
  EXPECT_THAT(glue.text, HasSubstr("{\"__QX0_1\", 'Q', 1, 1, 0, 0u, &plchost_value_1}"));
}

TEST_F(MatiecGlue, MakesAnEventTaskOfSingle) {
  const Glue glue =
      write(kMain, kGo,
            std::string(kIdle) + "TASK edge (SINGLE := go, PRIORITY := 0); PROGRAM one WITH edge : Main;");
  EXPECT_THAT(texts(glue.problems), IsEmpty());
  EXPECT_THAT(glue.text, HasSubstr("plchost_edge_0(void) { return *__GET_GLOBAL_GO(); }"));
  EXPECT_THAT(glue.text, HasSubstr("{\"edge\", 0, 0L, plchost_edge_0,"));
}

TEST_F(MatiecGlue, CarriesTheTaskFileToTheApplication) {
  const Glue glue = write(kMain, kGo, std::string(kFast) + "PROGRAM one WITH fast : Main;", {},
                          "[task.fast]\nlate_policy='asap'\nstart_offset='250us'\ndrives_outputs=true\n"
                          "watchdog_time='5ms'\nwatchdog_sensitivity=3\nwatchdog_omitted_cycles=10\n"
                          "watchdog_policy='task'\n");
  EXPECT_THAT(texts(glue.problems), IsEmpty());
  EXPECT_THAT(glue.text, HasSubstr("plchost_options_0 = {250000L, 1, 1, 5000u, 3u, 10u, 1};"));
  EXPECT_THAT(glue.text, HasSubstr("plchost_retained_0, 0, &plchost_options_0, 0},"));
  const Glue without = write(kMain, kGo, std::string(kFast) + "PROGRAM one WITH fast : Main;");
  EXPECT_THAT(without.text, HasSubstr("plchost_retained_0, 0, 0, 0},"));
}

TEST_F(MatiecGlue, RunsATaskByAnExternalEventInPlaceOfWhatTheSourceSays) {
  const std::string one = "PROGRAM one WITH t : Main;";
  const std::string file = "task.t.external_event='product'";
  for (const auto& [task, remark] :
       {std::pair{"TASK t (INTERVAL := T#10ms, PRIORITY := 1);", "INTERVAL"},
        std::pair{"TASK t (SINGLE := go, INTERVAL := T#10ms, PRIORITY := 1);", "SINGLE"}}) {
    const Glue glue = write(kMain, kGo, task + one, {}, file);
    EXPECT_THAT(texts(glue.problems), IsEmpty());
    EXPECT_THAT(glue.text, HasSubstr("{\"t\", 1, 0L, 0, plchost_run_0, 0, plchost_uses_0, 0, "
                                     "plchost_retained_0, \"product\", 0, 0},"));
    EXPECT_THAT(texts(glue.remarks),
                ElementsAre(std::string("c.st:4:1: TASK t: the external event product runs it, so its ") +
                            remark + " is not used"));
  }
  const Glue bare = write(kMain, kGo, "TASK t (PRIORITY := 1);" + one + kIdle, {}, file);
  EXPECT_THAT(texts(bare.problems), IsEmpty());
  EXPECT_THAT(texts(bare.remarks), ElementsAre(HasSubstr("TASK idle runs no program")));
  EXPECT_THAT(texts(write(kMain, kGo, "TASK t (PRIORITY := 1);" + one + kIdle).problems),
              ElementsAre("c.st:4:1: TASK t has neither INTERVAL nor SINGLE, and no task file gives it an "
                          "external_event, so it never runs"));
  EXPECT_THAT(
      texts(write(kMain, kGo, "PROGRAM t : Main;", {}, file).remarks),
      ElementsAre("c.st:4:1: PROGRAM t has no TASK: the external event product runs it, with priority 31"));
}

TEST_F(MatiecGlue, SeesNoEdgeInATaskThatOnlyAnEventRuns) {
  EXPECT_THAT(texts(write(kMain, "VAR_GLOBAL go AT %IX0.0 : BOOL; END_VAR",
                          std::string(kFast) + "TASK edge (SINGLE := go, PRIORITY := 0);"
                                               "PROGRAM one WITH edge : Main; PROGRAM two WITH fast : Main;",
                          {{"BOOL", "__IX0_0", "%IX0.0"}}, "task.fast.external_event='product'")
                        .problems),
              ElementsAre(HasSubstr("SINGLE of edge would see no edge")));
}

TEST_F(MatiecGlue, SaysWhatWouldNeverRelease) {
  const std::string edge =
      std::string(kIdle) + "TASK edge (SINGLE := go, PRIORITY := 0); PROGRAM one WITH edge : Main;";
  const std::string input = "VAR_GLOBAL go AT %IX0.0 : BOOL; END_VAR";
  const std::vector<Located> located{{"BOOL", "__IX0_0", "%IX0.0"}};
  EXPECT_THAT(
      texts(write(kMain, input, edge, located).problems),
      ElementsAre("c.st:4:47: SINGLE of edge would see no edge: no task reads go at %IX0.0; add a TASK "
                  "with an INTERVAL and a program"));
  EXPECT_THAT(texts(write(kMain, "VAR_GLOBAL go AT %QX0.0 : BOOL; END_VAR",
                          edge + kFast + "PROGRAM two WITH fast : Other;", {{"BOOL", "__QX0_0", "%QX0.0"}})
                        .problems),
              ElementsAre(HasSubstr("no cyclic program writes go at %QX0.0")));
  EXPECT_THAT(texts(write(kMain, input, edge + kFast + "PROGRAM two WITH fast : Main;", located).problems),
              IsEmpty());
  EXPECT_THAT(texts(write(kMain, "VAR_GLOBAL go : INT; END_VAR", edge).problems),
              ElementsAre("c.st:4:47: SINGLE of edge: 'go' is no BOOL of a VAR_GLOBAL"));
}

// A push-button that only its own task uses.
TEST_F(MatiecGlue, ReadsTheInputOfAnEdgeInTheQuickestTask) {
  const Glue glue =
      write(std::string(kMain) + " PROGRAM Other VAR a : INT; END_VAR END_PROGRAM",
            "VAR_GLOBAL go AT %IX0.0 : BOOL; END_VAR",
            std::string("TASK slow (INTERVAL := T#1s, PRIORITY := 2);") + kFast +
                "TASK edge (SINGLE := go, PRIORITY := 0); PROGRAM rest : Other;"
                "PROGRAM two WITH slow : Other; PROGRAM one WITH edge : Main; PROGRAM three WITH "
                "fast : Other;",
            {{"BOOL", "__IX0_0", "%IX0.0"}});
  EXPECT_THAT(texts(glue.problems), IsEmpty());
  EXPECT_THAT(
      texts(glue.remarks),
      Contains(HasSubstr(
          "SINGLE of edge: the task fast reads go at %IX0.0, as no cyclic program has it in VAR_EXTERNAL")));
  EXPECT_THAT(glue.text, HasSubstr("plchost_uses_1[] = {\n  {0, &plchost_value_0, 0, 0},\n  {0}}"));
  EXPECT_THAT(glue.text, HasSubstr("plchost_uses_0[] = {\n  {0}}"));
  // An input of a program has a value of its own in each task.
  const Glue own = write(std::string(kMain) + " PROGRAM Other VAR a AT %IX0.0 : BOOL; END_VAR END_PROGRAM",
                         "VAR_GLOBAL go AT %IX0.0 : BOOL; END_VAR",
                         std::string(kFast) +
                             "TASK edge (SINGLE := go, PRIORITY := 0);"
                             "PROGRAM one WITH edge : Main; PROGRAM two WITH fast : Other;",
                         {{"BOOL", "__IX0_0", "%IX0.0"}});
  EXPECT_THAT(own.text, HasSubstr("plchost_uses_0[] = {\n  {0, &plchost_input_0_0, 0, 0},\n"
                                  "  {0, &plchost_value_0, 0, 0},\n  {0}}"));
}

TEST_F(MatiecGlue, WantsATaskWithAnInterval) {
  EXPECT_THAT(texts(write(kMain, kGo, "PROGRAM one : Main;").problems),
              ElementsAre(HasSubstr("no TASK of this CONFIGURATION has an INTERVAL, and iec2c needs one")));
}

TEST_F(MatiecGlue, RunsAProgramWithoutATaskFreewheelingAndSaysSo) {
  const Glue glue = write(kMain, kGo, "PROGRAM one : Main;");
  EXPECT_THAT(glue.text, HasSubstr("{\"one\", 31, 0L, 0, plchost_run_0,"));
  EXPECT_THAT(texts(glue.remarks),
              Contains("c.st:4:1: PROGRAM one has no TASK: it runs freewheeling, with priority 31"));
}

TEST_F(MatiecGlue, NamesTheGlobalsThatMayChangeInTheMiddleOfACycle) {
  const std::string both = std::string(kFast) + "PROGRAM one WITH fast : Main; PROGRAM two WITH slow : Main;";
  EXPECT_THAT(texts(write(kMain, kGo, "TASK slow (INTERVAL := T#1s, PRIORITY := 5);" + both).remarks),
              ElementsAre("c.st:2:12: the tasks slow, fast use go and can pre-empt each other: it may change "
                          "in the middle of a cycle. Set globals = \"copy\" in [program.NAME] of the task "
                          "file to prevent that"));
  EXPECT_THAT(texts(write(kMain, kGo, "TASK slow (INTERVAL := T#1s, PRIORITY := 1);" + both).remarks),
              IsEmpty());
  EXPECT_THAT(texts(write(kMain, "VAR_GLOBAL CONSTANT go : BOOL; END_VAR",
                          "TASK slow (INTERVAL := T#1s, PRIORITY := 5);" + both)
                        .remarks),
              IsEmpty());
}

TEST_F(MatiecGlue, SaysWhatTheCompilerCannotDoAndWhatIsDropped) {
  EXPECT_THAT(
      texts(write(kMain, kGo, std::string(kFast) + "PROGRAM one WITH fast : Main (a := go);").problems),
      ElementsAre(HasSubstr("iec2c cannot translate connections in parentheses")));
  EXPECT_THAT(texts(write(kMain, kGo,
                          std::string(kFast) +
                              "TASK idle (INTERVAL := T#1s, PRIORITY := 2); PROGRAM one WITH fast : Main;")
                        .remarks),
              ElementsAre(HasSubstr("TASK idle runs no program, so it is left out")));
  EXPECT_THAT(texts(write("PROGRAM Main VAR RETAIN a AT %QB0 : BYTE; END_VAR END_PROGRAM", "",
                          std::string(kFast) + "PROGRAM one WITH fast : Main;", {{"BYTE", "__QB0", "%QB0"}})
                        .remarks),
              ElementsAre(HasSubstr("RETAIN of a at %QB0 is not carried out")));
  EXPECT_THAT(
      texts(write(kMain, kGo, "TASK fast (INTERVAL := T#10ns, PRIORITY := 1); PROGRAM one WITH fast : Main;")
                .problems),
      ElementsAre(HasSubstr(
          "allowed are whole microseconds up to 71 minutes, and whole milliseconds up to 49 days")));
}

TEST_F(MatiecGlue, RefusesTwoThingsOfOneName) {
  const std::string one = "PROGRAM one WITH fast : Main;";
  EXPECT_THAT(
      texts(write(std::string(kMain) + " FUNCTION_BLOCK Fast END_FUNCTION_BLOCK", kGo, kFast + one).problems),
      ElementsAre(HasSubstr("c.st:4:1: 'fast' is the name of a POU, too")));
  EXPECT_THAT(texts(write(std::string(kMain) + " TYPE One : INT; END_TYPE", kGo, kFast + one).problems),
              ElementsAre(HasSubstr("'one' is the name of a TYPE, too")));
  EXPECT_THAT(texts(write(kMain, kGo, kFast + one + "PROGRAM Fast : Main;").problems),
              ElementsAre(HasSubstr("'Fast' is the name of a TASK, too")));
}

TEST_F(MatiecGlue, RefusesATypeThatDoesNotFitIntoItsPlace) {
  const Glue glue = write(kMain, "VAR_GLOBAL go AT %IW0 : BOOL; END_VAR",
                          std::string(kFast) + "PROGRAM one WITH fast : Main;", {{"BOOL", "__IW0", "%IW0"}});
  EXPECT_THAT(texts(glue.problems), ElementsAre("c.st:2:12: BOOL does not fit into %IW0"));
  EXPECT_THAT(texts(write(kMain, "VAR_GLOBAL go AT %IW0 : ARRAY[0..3] OF INT; END_VAR",
                          std::string(kFast) + "PROGRAM one WITH fast : Main;")
                        .problems),
              ElementsAre(HasSubstr("go at %IW0 is of type ARRAY[0..3] OF INT: only BOOL, integers")));
}

TEST_F(MatiecGlue, RefusesIntervalsThatTheInterfaceCannotHold) {
  for (const char* interval : {"T#50d", "T#4800000.001ms"}) {
    EXPECT_THAT(
        texts(write(kMain, kGo,
                    fmt::format("TASK fast (INTERVAL := {}, PRIORITY := 1); PROGRAM one WITH fast : Main;",
                                interval))
                  .problems),
        ElementsAre(HasSubstr("INTERVAL of fast: allowed are whole microseconds")))
        << interval;
  }
}

TEST_F(MatiecGlue, PutsOutTheOtherBitsOfItsBytesSinceAByteIsThatOfTheTaskThatChangedItLast) {
  const Glue glue = write(
      "PROGRAM A VAR a AT %QX0.0 : BOOL; END_VAR END_PROGRAM PROGRAM B VAR b AT %QX0.1 : BOOL; c AT %QX1.0 : "
      "BOOL; "
      "END_VAR END_PROGRAM",
      "",
      std::string(kFast) +
          "TASK slow (INTERVAL := T#1s, PRIORITY := 5); PROGRAM one WITH fast : A; PROGRAM two WITH slow : "
          "B;",
      {{"BOOL", "__QX0_0", "%QX0.0"}, {"BOOL", "__QX0_1", "%QX0.1"}, {"BOOL", "__QX1_0", "%QX1.0"}});
  EXPECT_THAT(texts(glue.problems), IsEmpty());
  EXPECT_THAT(
      glue.text,
      HasSubstr(
          "plchost_uses_0[] = {\n  {0, &plchost_value_0, 0, 0},\n  {1, &plchost_value_1, 1, 0},\n  {0}}"));
}

TEST_F(MatiecGlue, RefusesOutputsThatShareBitsInTwoTasks) {
  const std::vector<Located> located{{"BYTE", "__QB0", "%QB0"}, {"BOOL", "__QX0_1", "%QX0.1"}};
  const std::string programs =
      "PROGRAM A VAR a AT %QB0 : BYTE; END_VAR END_PROGRAM PROGRAM B VAR b AT %QX0.1 : BOOL; END_VAR "
      "END_PROGRAM";
  const std::string slow = "TASK slow (INTERVAL := T#1s, PRIORITY := 5); PROGRAM one WITH fast : A; ";
  EXPECT_THAT(texts(write(programs, "", kFast + slow + "PROGRAM two WITH slow : B;", located).problems),
              ElementsAre(HasSubstr(
                  "%QX0.1 and %QB0 share bits, and the tasks fast, slow use them: use both in one task")));
  const Glue one = write(programs, "", kFast + slow + "PROGRAM two WITH fast : B;", located);
  EXPECT_THAT(texts(one.problems), IsEmpty());
  EXPECT_THAT(one.text, HasSubstr("{\"__QB0\", 'Q', 1, -1, 1, 0u, &plchost_value_0}"));
  EXPECT_THAT(one.text, HasSubstr("A_body__(&PRESS__ONE);\n  plchost_settle_places(&plchost_tasks[0]);\n"
                                  "  B_body__(&PRESS__TWO);\n  plchost_end(0);"))
      << "the second program has what the first one has written";
}

// The word and its two bits, of which one is declared twice.
TEST_F(MatiecGlue, JoinsThePlacesOfATaskThatShareBits) {
  const Glue glue = write(
      "PROGRAM A VAR a AT %MX0.0 : BOOL; b AT %MW0 : WORD; END_VAR END_PROGRAM "
      "PROGRAM B VAR c AT %MX0.0 : BOOL; d AT %MX1.0 : BOOL; END_VAR END_PROGRAM",
      "", std::string(kFast) + "PROGRAM one WITH fast : A; PROGRAM two WITH fast : B;",
      {{"BOOL", "__MX0_0", "%MX0.0"},
       {"WORD", "__MW0", "%MW0"},
       {"BOOL", "__MX0_0", "%MX0.0"},
       {"BOOL", "__MX1_0", "%MX1.0"}});
  EXPECT_THAT(glue.text, HasSubstr("plchost_uses_0[] = {\n  {1, &plchost_value_1, 0, 1},\n"
                                   "  {0, &plchost_value_0, 0, 2},\n  {2, &plchost_value_2, 0, 0},\n  {0}}"));
}

TEST_F(MatiecGlue, PlacesLocationsOfSeveralNumbers) {
  const std::string programs =
      "PROGRAM A VAR a AT %IW0.1.2 : INT; b AT %IW0.1.1 : INT; c AT %QW0 : INT; d AT %QW0.1 : INT; END_VAR "
      "END_PROGRAM";
  const std::vector<Located> located{{"INT", "__IW0_1_2", "%IW0.1.2"},
                                     {"INT", "__IW0_1_1", "%IW0.1.1"},
                                     {"INT", "__QW0", "%QW0"},
                                     {"INT", "__QW0_1", "%QW0.1"}};
  const std::string tasks = std::string(kFast) + "TASK slow (INTERVAL := T#1s, PRIORITY := 1); ";
  const Glue chosen = write(programs, "", tasks + "PROGRAM one WITH fast : A;", located);
  EXPECT_THAT(texts(chosen.problems), IsEmpty());
  EXPECT_THAT(chosen.text, HasSubstr("{\"__IW0_1_2\", 'I', 2, -1, 0, 2u, &plchost_value_0}"));
  EXPECT_THAT(chosen.text, HasSubstr("{\"__IW0_1_1\", 'I', 2, -1, 0, 0u, &plchost_value_1}"));
  EXPECT_THAT(chosen.text, HasSubstr("{\"__QW0\", 'Q', 2, -1, 0, 0u, &plchost_value_2}"));
  EXPECT_THAT(chosen.text, HasSubstr("plchost_location_count = 4;"));
  EXPECT_THAT(chosen.text, HasSubstr("{\"location-IW0.1.1\", 1u},\n  {\"location-IW0.1.2\", 17u},\n"
                                     "  {\"location-QW0\", 1u},\n  {\"location-QW0.1\", 17u},\n  {0}}"))
      << "an online change compares them";
  EXPECT_THAT(texts(chosen.remarks), Contains(HasSubstr("%IW0.1.2 lies in bytes 2 to 3 of the inputs.")));
  const Glue one = write(programs, "", tasks + "PROGRAM one WITH fast : A; PROGRAM two WITH slow : A;",
                         located, "[location]\n'%IW0.1.2' = '%IW5'\n'%IW0.1.1' = '%IW5'\n'%QW0.1' = '%QW0'");
  EXPECT_THAT(texts(one.problems), IsEmpty());
  EXPECT_THAT(one.text, HasSubstr("\"__IW0_1_2\", 'I', 2, -1, 0, 10u, "));
  EXPECT_THAT(one.text, HasSubstr("static INT plchost_value_1;\nINT *__QW0 = &plchost_value_1;\n"
                                  "INT *__QW0_1 = &plchost_value_1;\n"))
      << "both names have one value";
  EXPECT_THAT(one.text, HasSubstr("  __IW0_1_2 = &plchost_input_1_0;\n  __IW0_1_1 = &plchost_input_1_0;\n"))
      << "and in each task one value of its own";
  EXPECT_THAT(texts(one.remarks), Contains(HasSubstr("%QW0 shares its bits with %QW0.1")));
}

TEST_F(MatiecGlue, PlacesLocationsApartAsInOpenPlc) {
  const std::vector<Located> located{{"INT", "__QW0", "%QW0"}, {"BOOL", "__QX0_1", "%QX0.1"}};
  const std::string programs =
      "PROGRAM A VAR a AT %QW0 : INT; END_VAR END_PROGRAM PROGRAM B VAR b AT %QX0.1 : BOOL; END_VAR "
      "END_PROGRAM";
  const std::string tasks = std::string(kFast) +
                            "TASK slow (INTERVAL := T#1s, PRIORITY := 5); PROGRAM one WITH fast : A; "
                            "PROGRAM two WITH slow : B;";
  const Glue shared = write(programs, "", tasks, located);
  EXPECT_THAT(texts(shared.problems), ElementsAre(HasSubstr("%QX0.1 and %QW0 share bits")));
  EXPECT_THAT(texts(shared.remarks), ElementsAre(HasSubstr("a.st:1:15: %QW0 shares its bits with %QX0.1")));
  const Glue apart = write(programs, "", tasks, located, "locations = 'separate'");
  EXPECT_THAT(texts(apart.problems), IsEmpty()) << "each task has outputs of its own";
  EXPECT_THAT(apart.text, HasSubstr("{\"__QW0\", 'Q', 2, -1, 0, 2048u, &plchost_value_0}"));
  EXPECT_THAT(apart.text, HasSubstr("plchost_locations[] = {\n  {\"location-QW0\", 16385u},\n"
                                    "  {\"location-QX0.1\", 2u},\n  {0}}"));
  EXPECT_THAT(apart.text, HasSubstr("{\"__QX0_1\", 'Q', 1, 1, 0, 0u, &plchost_value_1}"));
}

TEST_F(MatiecGlue, GivesEachTaskItsOwnValueOfAnInputOfItsPrograms) {
  const std::string slow =
      "TASK slow (INTERVAL := T#1s, PRIORITY := 5); PROGRAM one WITH fast : Main; PROGRAM two WITH slow : "
      "Main;";
  const Glue glue = write(kMain, kGo, kFast + slow, {{"INT", "__IW2", "%IW2"}});
  EXPECT_THAT(texts(glue.problems), IsEmpty());
  EXPECT_THAT(glue.text, HasSubstr("{0, &plchost_input_0_0, 0, 0}"));
  EXPECT_THAT(glue.text, HasSubstr("{0, &plchost_input_1_0, 0, 0}"));
  EXPECT_THAT(glue.text, HasSubstr("  __IW2 = &plchost_input_1_0;\n  MAIN_init__(&PRESS__TWO, 0);\n"));
}

TEST_F(MatiecGlue, SaysWhichLocationsItHasNotUnderstood) {
  const Glue glue = write("PROGRAM Main raw AT %IW2 : INT; END_VAR END_PROGRAM", "",
                          std::string(kFast) + "PROGRAM one WITH fast : Main;", {{"INT", "__IW2", "%IW2"}});
  EXPECT_THAT(texts(glue.problems),
              ElementsAre("a.st:1:21: %IW2: the declaration around it is not understood"));
}

TEST_F(MatiecGlue, NamesAllVariablesOfItsProgramsAndTheirBlocks) {
  const Glue glue = write(
      "TYPE Point : STRUCT x : INT; END_STRUCT; END_TYPE "
      "FUNCTION_BLOCK Pump VAR_INPUT on : BOOL; END_VAR VAR hours : DINT; late : TON; END_VAR VAR_TEMP t : "
      "INT; END_VAR "
      "VAR_IN_OUT p : INT; END_VAR END_FUNCTION_BLOCK "
      "PROGRAM Main VAR RETAIN count : DINT; END_VAR VAR pump : Pump; spot : Point; m : INT; END_VAR "
      "VAR CONSTANT most : INT := 3; END_VAR VAR_EXTERNAL go : BOOL; END_VAR END_PROGRAM",
      "VAR_GLOBAL RETAIN go : BOOL; END_VAR", std::string(kFast) + "PROGRAM m WITH fast : Main;");
  EXPECT_THAT(texts(glue.problems), IsEmpty());
  EXPECT_THAT(glue.text, HasSubstr("v.path = \"M.COUNT\"; v.value = &PRESS__M.COUNT.value; v.bytes = sizeof "
                                   "PRESS__M.COUNT.value;"));
  EXPECT_THAT(glue.text, HasSubstr("&PRESS__M.PUMP.ON.value;"));
  EXPECT_THAT(glue.text, HasSubstr("&PRESS__M.PUMP.LATE;"));
  EXPECT_THAT(glue.text, HasSubstr("&PRESS__M.SPOT.value;"));
  EXPECT_THAT(glue.text, HasSubstr("&(*__GET_GLOBAL_GO());"));
  EXPECT_THAT(glue.text, HasSubstr("#undef M\n")) << "the resource's macro for the instance";
  for (const char* nothing : {"PUMP.T.", "PUMP.P", "MOST", "M.GO"})
    EXPECT_THAT(glue.text, Not(HasSubstr(nothing)));
  EXPECT_THAT(glue.text, HasSubstr("plchost_retained_0[] = {0, 1, 0};"));
}

// iec2c keeps the flags of each variable beside its value, but those of a block are in its variables.
TEST_F(MatiecGlue, KeepsTheVariablesOfGlobalBlocks) {
  const Glue glue = write(
      "FUNCTION_BLOCK Pump VAR_INPUT on : BOOL; END_VAR VAR done : CTU; END_VAR END_FUNCTION_BLOCK "
      "PROGRAM Main VAR_EXTERNAL count : CTU; left : Pump; late : TON; END_VAR END_PROGRAM",
      "VAR_GLOBAL RETAIN count : CTU; late : TON; END_VAR VAR_GLOBAL left : Pump; END_VAR",
      std::string(kFast) + "PROGRAM m WITH fast : Main;");
  EXPECT_THAT(texts(glue.problems), IsEmpty());
  const auto kept = [&](const std::string& path, const std::string& value) {
    return glue.text.find(fmt::format("v.path = \"{0}\"; v.value = &{1}; v.bytes = sizeof {1};", path,
                                      value)) != std::string::npos;
  };
  EXPECT_TRUE(kept("COUNT", "(*__GET_GLOBAL_COUNT())"));
  EXPECT_TRUE(kept("LEFT.ON", "(*__GET_GLOBAL_LEFT()).ON.value"));
  EXPECT_TRUE(kept("LEFT.DONE", "(*__GET_GLOBAL_LEFT()).DONE"));
  EXPECT_TRUE(kept("LATE", "(*__GET_GLOBAL_LATE())"));
  EXPECT_THAT(glue.text, HasSubstr("plchost_retained_0[] = {0, 0};")) << "the counter only";
  EXPECT_THAT(texts(glue.remarks),
              ElementsAre("c.st:2:32: late is a TON: a timer begins anew at each start, RETAIN or not"));
}

TEST_F(MatiecGlue, HasAnotherLayoutIfATypeInItChanges) {
  const auto layout = [&](const std::string& type) {
    const Glue glue = write("TYPE Point : STRUCT x : " + type +
                                "; END_STRUCT; Path : ARRAY[1..2] OF Point; END_TYPE "
                                "PROGRAM Main VAR way : Path; END_VAR END_PROGRAM",
                            "", std::string(kFast) + "PROGRAM m WITH fast : Main;");
    const std::size_t at = glue.text.find("v.layout = ");
    return glue.text.substr(at, glue.text.find(';', at) - at);
  };
  EXPECT_EQ(layout("INT"), layout("int"));
  EXPECT_NE(layout("INT"), layout("WORD"));
}

TEST_F(MatiecGlue, LeavesTheOtherResourcesToTheirApplications) {
  const std::vector<iec::Source> sources{{"a.st",
                                          "PROGRAM Main END_PROGRAM CONFIGURATION cell "
                                          "RESOURCE press ON PLC TASK t (INTERVAL := T#1s, PRIORITY := 1); "
                                          "PROGRAM p WITH t : Main; END_RESOURCE "
                                          "RESOURCE robot ON PLC TASK t (INTERVAL := T#1s, PRIORITY := 1); "
                                          "PROGRAM q WITH t : Main; END_RESOURCE "
                                          "END_CONFIGURATION"}};
  const iec::Project project = iec::read_project(sources).project;
  const iec::Configuration& cell = project.configurations.at(0);
  const Glue glue = write_glue(project, cell, cell.resources.at(1), {});
  EXPECT_THAT(glue.text, HasSubstr("#include \"robot.c\""));
  EXPECT_THAT(glue.text, HasSubstr("void PRESS_init__(void) {}"));
  EXPECT_THAT(glue.text, HasSubstr("&ROBOT__Q"));
  EXPECT_THAT(glue.text, Not(HasSubstr("PRESS__P")));
}

TEST_F(MatiecGlue, GivesAProgramCopiesOfItsGlobals) {
  constexpr const char* kPrograms =
      "TYPE Row : ARRAY[0..3, 1..2] OF INT; END_TYPE "
      "FUNCTION_BLOCK Inner VAR_EXTERNAL go : BOOL; END_VAR END_FUNCTION_BLOCK "
      "PROGRAM Main VAR_EXTERNAL go : BOOL; rows : Row; most : INT; late : TON; END_VAR "
      "VAR part : Inner; END_VAR END_PROGRAM";
  constexpr const char* kGlobals =
      "VAR_GLOBAL go : BOOL; rows : Row; late : TON; END_VAR VAR_GLOBAL CONSTANT most : INT := 3; END_VAR";
  const std::string tasks = std::string(kFast) +
                            "TASK slow (INTERVAL := T#1s, PRIORITY := 5);"
                            "PROGRAM one WITH fast : Main; PROGRAM two WITH slow : Main;";
  const Glue glue = write(kPrograms, kGlobals, tasks, {}, "[program.two]\nglobals = 'copy'");
  EXPECT_THAT(texts(glue.problems), IsEmpty());
  EXPECT_THAT(glue.text,
              HasSubstr("static __typeof__(*PRESS__TWO.GO.value) plchost_copy_0, plchost_before_0;"));
  EXPECT_THAT(glue.text, HasSubstr("{0, &plchost_copy_0, &plchost_before_0, sizeof plchost_copy_0, sizeof "
                                   "plchost_copy_0, 0}"));
  EXPECT_THAT(glue.text, HasSubstr("sizeof plchost_copy_1, sizeof plchost_copy_1.table[0][0], 0}"));
  EXPECT_THAT(glue.text, HasSubstr("  plchost_copies[0].global = __GET_GLOBAL_GO();\n"
                                   "  PRESS__TWO.GO.value = &plchost_copy_0;\n"
                                   "  PRESS__TWO.PART.GO.value = &plchost_copy_0;\n"));
  EXPECT_THAT(glue.text, HasSubstr("plchost_begin(1);\n  plchost_take_copies(&plchost_copies[0], 2);\n"
                                   "  MAIN_body__(&PRESS__TWO);\n"
                                   "  plchost_put_copies(&plchost_copies[0], 2);\n  plchost_end(1);"));
  EXPECT_THAT(glue.text, HasSubstr("plchost_begin(0);\n  MAIN_body__(&PRESS__ONE);\n  plchost_end(0);"));
  EXPECT_THAT(texts(glue.remarks),
              Contains(HasSubstr("PROGRAM two has no copy of late: it is a function block")));
  EXPECT_THAT(texts(glue.remarks), Not(Contains(HasSubstr("use go and can pre-empt"))))
      << "nothing pre-empts the task fast, and two has a copy";
  const Glue other = write(kPrograms, kGlobals, tasks, {}, "[program.one]\nglobals = 'copy'");
  EXPECT_THAT(texts(other.remarks), Contains(HasSubstr("use go and can pre-empt")));
}

// The program would see the copy, and the block the global.
TEST_F(MatiecGlue, GivesNoCopyOfAGlobalThatABlockOutsideOfTheProgramUses) {
  const std::string tasks = std::string(kFast) + "PROGRAM one WITH fast : Main;";
  for (const char* const block : {"VAR_EXTERNAL part : Outer; END_VAR", "VAR_TEMP part : Outer; END_VAR"}) {
    const Glue glue = write(
        std::string("FUNCTION_BLOCK Inner VAR_EXTERNAL go : BOOL; most : INT; END_VAR END_FUNCTION_BLOCK "
                    "FUNCTION_BLOCK Outer VAR inner : Inner; END_VAR END_FUNCTION_BLOCK "
                    "PROGRAM Main VAR_EXTERNAL go : BOOL; more : INT; END_VAR ") +
            block + " END_PROGRAM",
        "VAR_GLOBAL go : BOOL; more : INT; part : Outer; END_VAR VAR_GLOBAL CONSTANT most : INT := 3; "
        "END_VAR",
        tasks, {}, "[program.one]\nglobals = 'copy'");
    EXPECT_THAT(texts(glue.problems), IsEmpty()) << block;
    EXPECT_THAT(glue.text, Not(HasSubstr("PRESS__ONE.GO"))) << block;
    EXPECT_THAT(glue.text, HasSubstr("PRESS__ONE.MORE.value = &plchost_copy_0;")) << block;
    EXPECT_THAT(
        texts(glue.remarks),
        Contains(HasSubstr("PROGRAM one has no copy of go: Inner uses it, and is global or temporary")))
        << block;
    EXPECT_THAT(texts(glue.remarks), Not(Contains(HasSubstr("no copy of most")))) << block;
  }
}

}  // namespace
}  // namespace plchost::matiec
