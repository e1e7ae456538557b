#include "instances/adapters/matiec/explained.hpp"

#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost::matiec {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// With an error of iec2c at that place.
std::vector<std::string> explained_at(unsigned line, unsigned column, const std::string& text,
                                      const std::string& error = "invalid") {
  const std::vector<iec::Source> sources{{"a.st", text}};
  return texts(explained({{{"a.st", line, column}, error}, {{"a.st", line, column}, error}}, sources,
                         iec::read_project(sources).project));
}

TEST(RefusedByIec2c, AreVariablesThatAreCalledAsAWordOrAType) {
  const std::string text =
      "FUNCTION_BLOCK Sensor END_FUNCTION_BLOCK\nFUNCTION_BLOCK b VAR_INPUT\n dt : REAL;\n R_EDGE : BOOL;\n"
      " sensor : Sensor; a : INT;\nEND_VAR END_FUNCTION_BLOCK\nCONFIGURATION c VAR_GLOBAL\n step : INT; "
      "END_VAR "
      "END_CONFIGURATION";
  EXPECT_THAT(explained_at(3, 2, text),
              ElementsAre("a.st:3:2: 'dt' is a word of the language; choose another name"));
  EXPECT_THAT(explained_at(4, 2, text), ElementsAre(HasSubstr("a.st:4:2: 'R_EDGE' is a word")));
  EXPECT_THAT(explained_at(5, 2, text),
              ElementsAre("a.st:5:2: 'sensor' is also the name of a type or POU; choose another name"));
  EXPECT_THAT(explained_at(8, 2, text), ElementsAre(HasSubstr("a.st:8:2: 'step' is a word")));
  EXPECT_THAT(explained_at(5, 19, text), ElementsAre("a.st:5:19: invalid"));
  EXPECT_THAT(explained_at(5, 3, text), ElementsAre("a.st:5:3: invalid"));
}

// iec2c has its error at the word before.
TEST(RefusedByIec2c, AreSuchVariablesAlsoIfTheyComeFirst) {
  const std::string text =
      "TYPE Mode : (a, b); END_TYPE\nFUNCTION_BLOCK f\nVAR\n mode : Mode; y : INT; END_VAR "
      "END_FUNCTION_BLOCK\n"
      "FUNCTION_BLOCK g VAR y : INT; step : INT; END_VAR END_FUNCTION_BLOCK";
  const std::string error = "unexpected token after 'VAR' in variable(s) declaration.";
  EXPECT_THAT(explained_at(3, 1, text, error),
              ElementsAre("a.st:4:2: 'mode' is also the name of a type or POU; choose another name"));
  EXPECT_THAT(explained_at(3, 1, text), ElementsAre("a.st:3:1: invalid")) << "of another error";
  EXPECT_THAT(explained_at(5, 18, text, error), ElementsAre("a.st:5:18: " + error)) << "y is no such name";
}

TEST(RefusedByIec2c, AreVariablesThatItDeclaresAndDoesNotKnow) {
  const std::string text =
      "FUNCTION_BLOCK b VAR_INPUT go : BOOL R_EDGE; stop : BOOL F_EDGE; END_VAR\n"
      "VAR s : STRING[10]; n : INT; END_VAR\n s := 'a';\n IF go OR stop THEN n := m; END_IF; "
      "END_FUNCTION_BLOCK";
  const std::string error = "Variable not declared in this scope.";
  EXPECT_THAT(
      explained_at(3, 2, text, error),
      ElementsAre("a.st:3:2: 's' is a STRING with a length, which iec2c knows in no statement; declare it "
                  "STRING"));
  EXPECT_THAT(
      explained_at(4, 5, text, error),
      ElementsAre("a.st:4:5: 'go' is an input with an edge, which iec2c knows in no statement; use R_TRIG "
                  "or F_TRIG"));
  EXPECT_THAT(explained_at(4, 11, text, error), ElementsAre(HasSubstr("'stop' is an input with an edge")));
  EXPECT_THAT(explained_at(4, 26, text, error), ElementsAre("a.st:4:26: " + error)) << "m";
  EXPECT_THAT(explained_at(3, 2, text), ElementsAre("a.st:3:2: invalid")) << "of another error";
}

TEST(RefusedByIec2c, IsTheThirdEdition) {
  EXPECT_THAT(
      explained_at(1, 1, "INTERFACE i\nMETHOD a END_METHOD METHOD b END_METHOD\nEND_INTERFACE"),
      ElementsAre(HasSubstr("a.st:1:1: INTERFACE: MATIEC knows the second edition of IEC 61131-3 only"),
                  HasSubstr("a.st:2:1: METHOD: MATIEC knows"), "a.st:1:1: invalid"));
  EXPECT_THAT(explained_at(1, 1, "FUNCTION_BLOCK FINAL f END_FUNCTION_BLOCK"),
              ElementsAre(HasSubstr("a.st:1:16: FINAL: MATIEC knows"), HasSubstr("invalid")));
  EXPECT_THAT(explained_at(1, 1, "FUNCTION_BLOCK f EXTENDS g END_FUNCTION_BLOCK"),
              ElementsAre(HasSubstr("a.st:1:18: EXTENDS: MATIEC knows"), HasSubstr("invalid")));
  EXPECT_THAT(explained_at(1, 1, "PROGRAM p VAR s : string(20); END_VAR END_PROGRAM"),
              ElementsAre(HasSubstr("a.st:1:19: STRING(n): MATIEC wants"), HasSubstr("invalid")));
}

TEST(RefusedByIec2c, IsNoVariableOfSuchAName) {
  EXPECT_THAT(explained_at(1, 1,
                           "PROGRAM p VAR method, final, extends : INT; property AT %MW0 : INT; END_VAR\n"
                           "method := final; (* END_METHOD STRING(20) *) END_PROGRAM"),
              ElementsAre("a.st:1:1: invalid"));
}

}  // namespace
}  // namespace plchost::matiec
