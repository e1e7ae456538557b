#include "instances/adapters/matiec/iec2c.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "instances/adapters/build_application.hpp"
#include "tests/support/own_name.hpp"
#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost::matiec {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::vector<iec::Source> kSources{{"a.st", "PROGRAM P\nEND_PROGRAM"},
                                        {"b.st", "TYPE Mode : INT; END_TYPE\n(* *)\n"}};

std::vector<std::string> told(const std::string& output) {
  const iec::Project project = iec::read_project(kSources).project;
  return texts(problems_of(output, JoinedSource(kSources), project, "/nowhere"));
}

TEST(Iec2cErrors, AreToldAtTheirPlaceInTheSources) {
  EXPECT_THAT(
      told("joined.st:2-5..2-9: error: one\njoined.st:4-3..4-4: error: two\n2 error(s) found. Bailing out!"),
      ElementsAre("a.st:2:5: one", "b.st:2:3: two"));
}

TEST(Iec2cErrors, AreToldOnceAndWarningsAreNone) {
  EXPECT_THAT(
      told("joined.st:1-1..1-2: error: x\njoined.st:1-1..1-2: error: x\njoined.st:1-1..1-2: warning: y"),
      ElementsAre("a.st:1:1: x"));
  EXPECT_THAT(told("anything\n" + std::string(100'000, 'x')), IsEmpty());
}

TEST(Iec2cWarnings, AreRemarksAtTheirPlaceInTheSources) {
  const std::string output =
      "joined.st:1-1..1-2: error: x\njoined.st:4-3..4-9: warning: Duplicate element found in CASE options.\n"
      "joined.st:4-3..4-9: warning: Duplicate element found in CASE options.\n"
      "/lib/ieclib.txt:4-3..4-9: warning: of the library";
  EXPECT_THAT(texts(remarks_of(output, JoinedSource(kSources))),
              ElementsAre("b.st:2:3: iec2c: Duplicate element found in CASE options."));
}

TEST(Iec2cErrors, InItsLibraryNameTheNameOfTheProgramThatItHasToo) {
  const std::string library = own_path("ieclib");
  std::ofstream(library) << "FUNCTION MAX\nVAR_INPUT P : INT; MODE : INT; END_VAR\n";
  EXPECT_THAT(told(library + ":2-11..2-12: error: invalid\n" + library + ":2-11..2-12: error: again"),
              ElementsAre("a.st:1:9: 'P' is also a name in the library of iec2c; choose another one, or "
                          "declare each POU and type before its use",
                          HasSubstr("b.st:1:6: 'Mode' is also a name in the library of iec2c")));
  std::remove(library.c_str());
}

TEST(Iec2cNames, OfItsLibraryAreRefusedWhereAProgramTakesThem) {
  const std::string library = own_path("ieclib");
  std::filesystem::create_directory(library);
  std::ofstream(library + "/pid_st.txt")
      << "(* FUNCTION NONE *)\nFUNCTION_BLOCK RAMP VAR TIMER : INT; END_VAR";
  std::ofstream(library + "/standard_functions.txt") << "FUNCTION MAX : INT\nEND_FUNCTION";
  const std::vector<iec::Source> sources{{"a.st",
                                          "FUNCTION_BLOCK Ramp\nEND_FUNCTION_BLOCK\nFUNCTION Timer : INT "
                                          "END_FUNCTION\nFUNCTION max : INT END_FUNCTION"}};
  EXPECT_THAT(texts(taken_names(iec::read_project(sources).project, library)),
              ElementsAre("a.st:1:16: 'Ramp' is also a name in the library of iec2c; choose another one",
                          "a.st:4:10: 'max' is also a name in the library of iec2c; choose another one"));
  std::filesystem::remove_all(library);
}

TEST(Iec2cNames, OfItsLibraryAreToldOfVariablesAndValuesToo) {
  const std::string library = own_path("ieclib");
  std::filesystem::create_directory(library);
  std::ofstream(library + "/standard_functions.txt")
      << "FUNCTION LEFT\nFUNCTION LIMIT\nFUNCTION_BLOCK INTEGRAL";
  const std::vector<iec::Source> sources{
      {"a.st",
       "TYPE Way : (Ahead, Left := 5); Limit : INT (0..5); Parts : STRUCT left : INT; END_STRUCT; END_TYPE\n"
       "FUNCTION_BLOCK Ctl\nVAR integral : REAL; END_VAR\nEND_FUNCTION_BLOCK\n"
       "CONFIGURATION c VAR_GLOBAL limit : INT; other : INT; END_VAR END_CONFIGURATION"}};
  EXPECT_THAT(texts(taken_variables(iec::read_project(sources).project, sources, library)),
              ElementsAre("a.st:3:5: 'integral' is also a name in the library of iec2c; choose another one",
                          "a.st:5:28: 'limit' is also a name in the library of iec2c; choose another one",
                          "a.st:1:20: 'Left' is also a name in the library of iec2c; choose another one",
                          "a.st:1:32: 'Limit' is also a name in the library of iec2c; choose another one"));
  std::filesystem::remove_all(library);
}

TEST(TheJoinedSource, CountsCharacters) {
  const JoinedSource joined(std::vector<iec::Source>{
      {"a.st", "\xEF\xBB\xBF(* \xC3\xA4 *) /* \xE6\x97\xA5 */ x := 'a$L';\ny := 1;\n"}});
  EXPECT_EQ(joined.place(1, 1).column, 1U);
  EXPECT_EQ(joined.place(1, 20).column, 17U) << "behind both comments";
  EXPECT_EQ(joined.place(1, 99).column, 95U) << "beyond the line";
  EXPECT_EQ(joined.place(2, 6).column, 6U);
}

TEST(TheJoinedSource, KnowsThatIec2cCountsOneTooManyWhereABodyBegins) {
  const JoinedSource joined(std::vector<iec::Source>{
      {"a.st",
       "PROGRAM P\nVAR a : INT; END_VAR (* *) a := 1; b := 2;\n  c := 3;\nEND_PROGRAM\n"
       "FUNCTION_BLOCK F\nVAR a : INT; END_VAR\nVAR_TEMP b : INT; END_VAR\n  IF a THEN\n  b := 2;\nEND_IF;\n"
       "END_FUNCTION_BLOCK\nCONFIGURATION c\nVAR_GLOBAL g : INT; END_VAR RESOURCE r ON PLC\n"}});
  const auto column = [&](unsigned line, unsigned told) { return joined.place(line, told).column; };
  EXPECT_EQ(column(2, 5), 5U) << "a declaration before";
  EXPECT_EQ(column(2, 29), 28U);
  EXPECT_EQ(column(2, 37), 36U);
  EXPECT_EQ(column(3, 3), 3U) << "the next line";
  EXPECT_EQ(column(7, 10), 10U) << "a section";
  EXPECT_EQ(column(8, 6), 6U) << "it knows this word";
  EXPECT_EQ(column(9, 3), 3U);
  EXPECT_EQ(column(13, 30), 30U) << "this is no body";
}

TEST(TheJoinedSource, HasLocatedVariablesInSectionsOfTheirOwn) {
  const auto joined = [](const std::string& text) {
    return JoinedSource(std::vector<iec::Source>{{"a.st", text}}).text();
  };
  EXPECT_EQ(
      joined(
          "PROGRAM P VAR a AT %QX0.0 : BOOL;\n t : TON;\n u : INT;\n b AT %qw1 : INT; END_VAR END_PROGRAM\n"),
      "PROGRAM P VAR a AT %QX0.0 : BOOL; END_VAR VAR\n t : TON;\n u : INT; END_VAR VAR\n b AT %QW1 : INT; "
      "END_VAR END_PROGRAM\n");
  EXPECT_EQ(joined("PROGRAM P VAR RETAIN a : INT; b AT %QB0 : BYTE; END_VAR END_PROGRAM\n"),
            "PROGRAM P VAR RETAIN a : INT; END_VAR VAR RETAIN b AT %QB0 : BYTE; END_VAR END_PROGRAM\n");
  for (const char* same :
       {"PROGRAM P VAR a : INT; b : INT; END_VAR VAR c AT %QB0 : BYTE; END_VAR END_PROGRAM\n",
        "CONFIGURATION c VAR_GLOBAL a : INT; b AT %QB0 : BYTE; END_VAR END_CONFIGURATION\n"}) {
    EXPECT_EQ(joined(same), same);
  }
}

TEST(TheJoinedSource, LetsIec2cCountEachLineBeforeTheBodyOfAnActionOnce) {
  const JoinedSource joined(
      std::vector<iec::Source>{{"a.st", "ACTION Count:\n\n n := 1; END_ACTION\nACTION x;"}});
  EXPECT_EQ(joined.text(), "ACTION Count: (**)\n\n n := 1; END_ACTION\nACTION x;\n");
  EXPECT_EQ(joined.place(3, 2), (iec::SourcePlace{"a.st", 3, 2}));
}

TEST(TheJoinedSource, HasNoCommentWithinATextAndNoLineFeed) {
  const JoinedSource joined(
      std::vector<iec::Source>{{"a.st", "t := 'ab(*no $L1$$L$'(*('; (* '(*' *) n := NOSUCH; u := '*)';"}});
  EXPECT_EQ(joined.text(), "t := 'ab$28*no $0A1$$L$'$28*('; (* '(*' *) n := NOSUCH; u := '*)';\n");
  EXPECT_EQ(joined.place(1, 50), (iec::SourcePlace{"a.st", 1, 45}));
}

TEST(TheJoinedSource, CountsColumnsWithoutTheSectionsThatItHasInserted) {
  const JoinedSource joined(std::vector<iec::Source>{
      {"0.st", "\n"},
      {"a.st", "PROGRAM P\nVAR a : INT; b AT %QX0.0 : BOOL; c : NOSUCH; END_VAR\nEND_PROGRAM\n"}});
  const auto column = [&](unsigned line, unsigned told) { return joined.place(line, told).column; };
  EXPECT_EQ(joined.place(3, 58), (iec::SourcePlace{"a.st", 2, 34}));
  EXPECT_EQ(column(3, 12), 12U) << "before the first one";
  EXPECT_EQ(column(3, 13), 13U);
  EXPECT_EQ(column(3, 20), 13U) << "a word that is inserted";
  EXPECT_EQ(column(3, 26), 14U) << "between both";
  EXPECT_EQ(column(4, 58), 58U) << "another line";
}

TEST(BuildOfAnApplication, SaysHowToGetACompiler) {
  const auto none = find_compiler("/nowhere");
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().describe(),
              HasSubstr("in /nowhere; build it there: autoreconf -i && ./configure && make"));
}

TEST(BuildOfAnApplication, SaysWhatIsWrongInTheSourcesBeforeItRunsACompiler) {
  const std::string file = own_path("source.st");
  std::ofstream(file) << "CONFIGURATION c RESOURCE r ON PLC TASK t (PRIORITY := 1); "
                         "TASK u (INTERVAL := T#1s, PRIORITY := 1); END_RESOURCE END_CONFIGURATION";
  const BuildReport report = build_application({.sources = {file},
                                                .output = file + ".so",
                                                .matiec = "/nowhere",
                                                .adapters = "",
                                                .keep = "",
                                                .check_program = ""});
  ASSERT_EQ(report.problems.size(), 1U);
  EXPECT_THAT(iec::describe(report.problems.front()),
              HasSubstr(file + ":1:35: TASK t has neither INTERVAL nor SINGLE"));
  EXPECT_THAT(report.applications, IsEmpty());
  std::remove(file.c_str());
}

}  // namespace
}  // namespace plchost::matiec
