#include "instances/adapters/matiec/refused.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost::matiec {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<iec::Source> source(const std::string& text) {
  return {{"a.st", text}};
}
std::vector<std::string> names(const std::string& text) {
  return texts(refused_names(iec::read_project(source(text)).project));
}
std::vector<std::string> words(const std::string& text) {
  return texts(refused_words(source(text)));
}

TEST(RefusedByMatiec, AreNamesThatAreMacrosOfC) {
  EXPECT_THAT(
      names("PROGRAM Prg VAR nan : INT; eof : INT;\n rand_max : INT; a : INT; END_VAR END_PROGRAM"),
      ElementsAre(HasSubstr("a.st:1:17: 'nan' is a macro of the C library"),
                  HasSubstr("a.st:1:28: 'eof' is a macro"), HasSubstr("a.st:2:2: 'rand_max' is a macro")));
  EXPECT_THAT(names("FUNCTION infinity : INT END_FUNCTION"), ElementsAre(HasSubstr("a.st:1:10: 'infinity'")));
  EXPECT_THAT(names("TYPE\n Point : STRUCT x : REAL; NULL : REAL; END_STRUCT;\nEND_TYPE"),
              ElementsAre(HasSubstr("a.st:2:2: 'NULL'")));
  EXPECT_THAT(
      names("CONFIGURATION c VAR_GLOBAL M_PI : REAL; END_VAR RESOURCE r ON PLC VAR_GLOBAL int_max : INT; "
            "END_VAR END_RESOURCE END_CONFIGURATION"),
      ElementsAre(HasSubstr("'M_PI'"), HasSubstr("'int_max'")));
}

std::vector<std::string> pous(const std::string& text) {
  return texts(refused_pous(iec::read_project(source(text)).project, source(text)));
}

TEST(RefusedByMatiec, ArePousWithoutVariables) {
  EXPECT_THAT(
      pous(
          "PROGRAM Main\n x := 1; END_PROGRAM\nFUNCTION_BLOCK Idle VAR END_VAR END_FUNCTION_BLOCK\n"
          "FUNCTION Five : INT Five := 5; END_FUNCTION FUNCTION Id : INT VAR_INPUT a : INT; END_VAR Id := a; "
          "END_FUNCTION"),
      ElementsAre(
          "a.st:1:9: PROGRAM Main has no variables, and iec2c cannot translate it; declare one",
          "a.st:3:16: FUNCTION_BLOCK Idle has no variables, and iec2c cannot translate it; declare one",
          "a.st:4:10: FUNCTION Five has no variables, and iec2c cannot translate it; declare one"));
}

TEST(RefusedByMatiec, AreEnumerationsWithoutAName) {
  EXPECT_THAT(
      pous("PROGRAM Main VAR a : (red, green) := green;\n b : INT (0..5); END_VAR a := red; END_PROGRAM\n"
           "CONFIGURATION c VAR_GLOBAL g : (on1, off1); END_VAR END_CONFIGURATION"),
      ElementsAre(HasSubstr("a.st:3:28: 'g' has an enumeration of its own"),
                  "a.st:1:18: 'a' has an enumeration of its own, which iec2c cannot translate; give that a "
                  "name in TYPE ... END_TYPE"));
}

TEST(RefusedByMatiec, AreBodiesThatBeginWithoutAStatement) {
  EXPECT_THAT(
      pous("PROGRAM Main VAR a : INT; END_VAR VAR_TEMP b : INT; END_VAR\n (* none *) ; END_PROGRAM"),
      ElementsAre("a.st:2:13: iec2c cannot translate a body that begins with ';'; write a statement there"));
  EXPECT_THAT(pous("PROGRAM Main VAR a : INT; END_VAR a := 1;; END_PROGRAM"), IsEmpty());
}

TEST(RefusedByMatiec, AreSuchNamesOfAConfiguration) {
  EXPECT_THAT(
      names("PROGRAM Main END_PROGRAM CONFIGURATION NAN RESOURCE Main ON PLC TASK eof (INTERVAL := T#1ms, "
            "PRIORITY := 1); PROGRAM NULL WITH eof : Main; END_RESOURCE END_CONFIGURATION"),
      ElementsAre(HasSubstr("'NAN' is a macro"), HasSubstr("'eof' is a macro"),
                  HasSubstr("'NULL' is a macro"), HasSubstr("RESOURCE Main: a POU has this name")));
}

TEST(RefusedByMatiec, AreOthersWithTheNameOfTheConfiguration) {
  EXPECT_THAT(
      names("FUNCTION cell : INT END_FUNCTION PROGRAM Main VAR a : INT;\n cell : INT; END_VAR END_PROGRAM "
            "CONFIGURATION Cell VAR_GLOBAL CELL "
            ": INT; "
            "END_VAR RESOURCE r ON PLC VAR_GLOBAL Cell : INT; END_VAR END_RESOURCE END_CONFIGURATION"),
      ElementsAre(HasSubstr("a.st:1:10: 'cell' is"),
                  HasSubstr("a.st:2:2: 'cell' is also the name of the CONFIGURATION"),
                  HasSubstr("'CELL' is also"), HasSubstr("'Cell' is also")));
}

TEST(RefusedByMatiec, IsNoNameOfWhichItMakesAnother) {
  EXPECT_THAT(
      names("TYPE Mode : (eof, nan); END_TYPE PROGRAM p VAR pi : REAL; m : Mode := eof; END_VAR END_PROGRAM"),
      IsEmpty());
}

TEST(RefusedByMatiec, AreWideTexts) {
  EXPECT_THAT(words("PROGRAM p VAR a : INT;\n b : wstring; c : WSTRING; END_VAR END_PROGRAM"),
              ElementsAre(HasSubstr("a.st:2:6: WSTRING: iec2c cannot translate it")));
  EXPECT_THAT(words("a := \"abc\";"), ElementsAre(HasSubstr("a.st:1:6: WSTRING")));
  EXPECT_THAT(words("(* WSTRING *) a := 'WSTRING \"'; {WSTRING}"), IsEmpty());
}

}  // namespace
}  // namespace plchost::matiec
