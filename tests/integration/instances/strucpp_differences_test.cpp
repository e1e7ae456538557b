// Values that STruC++ makes other than IEC 61131-3 says, and other than MATIEC: a build tells each at its
// place.

#include <initializer_list>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/instances/structured_text_fixture.hpp"

namespace plchost::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string kTask =
    "RESOURCE r ON PLC TASK t (INTERVAL := T#2ms, PRIORITY := 1); PROGRAM m WITH t : Prg; END_RESOURCE "
    "END_CONFIGURATION\n";

class DifferencesOfStrucpp : public StructuredText {
 protected:
  void SetUp() override {
    if (!has("PLCHOST_STRUCPP")) GTEST_SKIP() << "needs STruC++";
  }

  /// The program has three lines before its statements.
  ProgramEnd built(const std::string& variables, const std::string& statements,
                   const std::string& before = "") const {
    return build(fmt::format("{}\nPROGRAM Prg\nVAR {} END_VAR\n{}\nEND_PROGRAM\nCONFIGURATION k {}", before,
                             variables, statements, kTask),
                 "other", "strucpp");
  }
  static void expect_told(const ProgramEnd& end, std::initializer_list<const char*> told) {
    for (const std::string one : told) {
      const auto first = end.output.find(one);
      EXPECT_NE(first, std::string::npos) << one << "\n" << end.output;
      EXPECT_EQ(end.output.find(one, first + 1), std::string::npos) << one << " is told twice";
    }
  }
};

TEST_F(DifferencesOfStrucpp, AConstantThatIsWrittenIsRefused) {
  const ProgramEnd end = build(R"(
FUNCTION_BLOCK Fb VAR_IN_OUT x : INT; END_VAR VAR_OUTPUT o : INT; END_VAR VAR_EXTERNAL limit : INT; END_VAR
METHOD Shadows : INT VAR limit : INT; END_VAR limit := 3; END_METHOD
METHOD Touches : INT VAR n : INT; END_VAR limit := n; END_METHOD
x := 1; END_FUNCTION_BLOCK
FUNCTION Fu : INT VAR_INPUT a : INT; END_VAR VAR_IN_OUT b : INT; END_VAR b := a; Fu := 1; END_FUNCTION
PROGRAM Prg VAR_EXTERNAL Limit, free : INT; row : ARRAY[0..2] OF INT; END_VAR VAR b : Fb; i : INT; END_VAR
free := Limit; b(x := i, o => free); i := Fu(Limit, i);
Limit := 5;
row[1] := 4;
FOR Limit := 1 TO 3 DO i := i + 1; END_FOR;
b(x := i, o => Limit);
b(x := Limit);
i := Fu(i, Limit);
END_PROGRAM
CONFIGURATION k VAR_GLOBAL CONSTANT Limit : INT := 3; row : ARRAY[0..2] OF INT := [1, 2, 3]; END_VAR
VAR_GLOBAL free : INT; END_VAR )" + kTask,
                               "other", "strucpp");
  EXPECT_FALSE(end.success());
  expect_told(end, {"other.st:4:43: limit is CONSTANT", "other.st:9:1: Limit is CONSTANT",
                    "other.st:10:1: row is CONSTANT", "other.st:11:1: Limit is CONSTANT",
                    "other.st:12:16: Limit is CONSTANT", "other.st:13:8: Limit is CONSTANT",
                    "other.st:14:12: Limit is CONSTANT"});
  EXPECT_THAT(end.output, Not(HasSubstr("other.st:3:")));
  EXPECT_THAT(end.output, Not(HasSubstr("other.st:8:")));
}

TEST_F(DifferencesOfStrucpp, TheFirstCycleOfAFallingEdgeIsTold) {
  const ProgramEnd end = built("edge1 : F_TRIG; rising : R_TRIG;\n  h : Heir;", "edge1(CLK := FALSE);",
                               "FUNCTION_BLOCK Base VAR inner : F_TRIG; END_VAR inner(); END_FUNCTION_BLOCK "
                               "FUNCTION_BLOCK Heir EXTENDS Base VAR n : INT; END_VAR n := 1; "
                               "END_FUNCTION_BLOCK");
  ASSERT_TRUE(end.success()) << end.output;
  expect_told(end, {"other.st:3:5: note: edge1: F_TRIG of STruC++ has no edge in its first cycle",
                    "other.st:1:25: note: inner: F_TRIG of STruC++ has no edge in its first cycle"});
  EXPECT_THAT(end.output, Not(HasSubstr("rising: ")));
}

TEST_F(DifferencesOfStrucpp, RoundingIsToldWhereItCanMatter) {
  const ProgramEnd end = built("r : REAL; l : LREAL; i : INT; d : DINT;",
                               "i := REAL_TO_INT(r);\nd := LREAL_TO_DINT(l) + TO_DINT(r);\n"
                               "d := REAL_TO_DINT(2.5);\nd := REAL_TO_DINT(3.0); r := "
                               "DINT_TO_REAL(d); i := DINT_TO_INT(d);");
  ASSERT_TRUE(end.success()) << end.output;
  const char* const rounds = "STruC++ rounds 2.5 to 3, and IEC 61131-3 to 2";
  EXPECT_THAT(end.output, HasSubstr(fmt::format("other.st:4:6: note: REAL_TO_INT: {}", rounds)));
  EXPECT_THAT(end.output, HasSubstr(fmt::format("other.st:5:6: note: LREAL_TO_DINT: {}", rounds)));
  EXPECT_THAT(end.output, HasSubstr(fmt::format("other.st:5:25: note: TO_DINT: {}", rounds)));
  EXPECT_THAT(end.output, HasSubstr(fmt::format("other.st:6:6: note: REAL_TO_DINT: {}", rounds)));
  EXPECT_THAT(end.output, Not(HasSubstr("other.st:7:")));
}

TEST_F(DifferencesOfStrucpp, UnitsOfTimesAreTold) {
  const ProgramEnd end = built("t : TIME; d : DINT; r : REAL;",
                               "d := TIME_TO_DINT(t);\nt := DINT_TO_TIME(d); r := TIME_TO_REAL(t);\n"
                               "t := REAL_TO_TIME(r);\nr := DINT_TO_REAL(d); t := T#1s;");
  ASSERT_TRUE(end.success()) << end.output;
  expect_told(end, {"other.st:4:6: note: TIME_TO_DINT: STruC++ counts milliseconds, and MATIEC seconds",
                    "other.st:5:6: note: DINT_TO_TIME: STruC++ counts milliseconds, and MATIEC seconds",
                    "other.st:5:28: note: TIME_TO_REAL: STruC++ counts milliseconds, and MATIEC seconds",
                    "other.st:6:6: note: REAL_TO_TIME: STruC++ counts milliseconds, and MATIEC seconds"});
  EXPECT_THAT(end.output, Not(HasSubstr("other.st:7:")));
}

TEST_F(DifferencesOfStrucpp, ADifferenceThatWrapsWhereItIsComparedIsTold) {
  const ProgramEnd end = built("u, v : USINT; w : UINT; n : UDINT; i : INT; ok : BOOL;",
                               "ok := u - USINT#1 > USINT#0;\nok := 3 < (w - w);\n"
                               "ok := n - n > n; ok := i - i > i; ok := u > v; u := u - v; ok := u - 1 > 0;");
  ASSERT_TRUE(end.success()) << end.output;
  expect_told(end, {"other.st:4:7: note: this difference of USINT wraps before STruC++ compares it",
                    "other.st:5:7: note: this difference of UINT wraps before STruC++ compares it"});
  EXPECT_THAT(end.output, Not(HasSubstr("other.st:6:")));
}

// A caller knows other variables of these names, or none.
TEST_F(DifferencesOfStrucpp, InitialValuesThatNameAConstantOfTheBlockAreNotTakenForAGlobal) {
  const ProgramEnd end =
      built("b : Base; h : Heir; i : INT;",
            "i := b.Join(b := 2); i := h.More();\ni := b.Join();\ni := b.Odd();\n"
            "i := b.Join(a := 1) + h.More(2) + b.Odd(3);",
            "VAR_GLOBAL CONSTANT kMost : INT := 9; END_VAR FUNCTION_BLOCK Base VAR CONSTANT kMost : INT := "
            "5; END_VAR METHOD PUBLIC Join : INT VAR_INPUT a : INT := kMost; b : INT := 8; END_VAR "
            "Join := a + b; END_METHOD METHOD PUBLIC Odd : INT VAR_INPUT a : INT := kNone; END_VAR "
            "Odd := a; END_METHOD END_FUNCTION_BLOCK FUNCTION_BLOCK Heir EXTENDS Base METHOD "
            "PUBLIC More : INT VAR_INPUT a : INT := kMost; END_VAR More := a; END_METHOD "
            "END_FUNCTION_BLOCK");
  EXPECT_FALSE(end.success());
  expect_told(end,
              {"other.st:4:6: JOIN: STruC++ wants each parameter in this call of a method; add A := ...",
               "other.st:4:27: MORE: STruC++ wants each parameter in this call of a method; add A := ...",
               "other.st:5:6: JOIN: STruC++ wants each parameter in this call of a method; add A := ...",
               "other.st:6:12: Undeclared variable 'KNONE': the initial value of an input that this "
               "call leaves out; give the input"});
  EXPECT_THAT(end.output, Not(HasSubstr("other.st:7:")));
}

// A call of the type above would pass its arguments in another order.
TEST_F(DifferencesOfStrucpp, AMethodWithOtherParametersThanTheOneThatItStandsForIsRefused) {
  const ProgramEnd end =
      build(R"(INTERFACE Goes METHOD Go : INT VAR_INPUT x : INT; y : INT; END_VAR END_METHOD END_INTERFACE
INTERFACE Walks EXTENDS Goes METHOD Walk : INT VAR_INPUT x : INT; END_VAR END_METHOD END_INTERFACE
FUNCTION_BLOCK Base
METHOD PUBLIC Go : INT VAR_INPUT y : INT; x : INT; END_VAR Go := x; END_METHOD
METHOD PUBLIC Fine : INT VAR_INPUT y : INT; END_VAR VAR_IN_OUT x : INT; END_VAR Fine := x; END_METHOD
METHOD PUBLIC Walk : INT VAR_INPUT x : INT; END_VAR Walk := x; END_METHOD
END_FUNCTION_BLOCK
FUNCTION_BLOCK Heir EXTENDS Base IMPLEMENTS Walks
METHOD PUBLIC OVERRIDE Fine : INT VAR_INPUT Y : INT := 3; END_VAR VAR_IN_OUT X : INT; END_VAR VAR q : INT; END_VAR Fine := q; END_METHOD
END_FUNCTION_BLOCK
FUNCTION_BLOCK Next EXTENDS Heir
METHOD PUBLIC Fine : INT VAR_INPUT y : DINT; END_VAR VAR_IN_OUT x : INT; END_VAR Fine := x; END_METHOD
METHOD PUBLIC OVERRIDE Walk : INT VAR_INPUT z : INT; END_VAR Walk := z; END_METHOD
END_FUNCTION_BLOCK
FUNCTION_BLOCK Other IMPLEMENTS Goes
METHOD PUBLIC Go : INT VAR_INPUT x : INT; END_VAR VAR_IN_OUT y : INT; END_VAR Go := x; END_METHOD
END_FUNCTION_BLOCK
PROGRAM Prg VAR n : Next; END_VAR n(); END_PROGRAM
CONFIGURATION k )" +
                kTask,
            "other", "strucpp");
  EXPECT_FALSE(end.success());
  const auto told = [](const char* place, const char* method, const char* type) {
    return fmt::format("other.st:{}: {}: its parameters are not those of {},", place, method, type);
  };
  expect_told(end, {told("8:1", "GO", "GOES").c_str(), told("12:1", "FINE", "HEIR").c_str(),
                    told("13:1", "WALK", "BASE").c_str(), told("16:1", "GO", "GOES").c_str(),
                    "declare them as there: VAR_INPUT Y : INT, VAR_IN_OUT X : INT"});
  EXPECT_THAT(end.output, Not(HasSubstr("other.st:9:")));
}

TEST_F(DifferencesOfStrucpp, TextsThatItMakesOthersOfAreRefused) {
  const ProgramEnd end = built("w, v : WSTRING(9) := \"q$\"q\"; s : STRING(9) := '$C3$A4$00z';",
                               R"(w := "$$$"";
w := "it''s";
w := "$0041B";
w := "$"a";
s := '$41B';
s := '$00';
w := "$0041z$20AC"; w := "\$$"; w := "ä€😀'"; s := 'it''s$'\$$"'; s := '$C3$A4$N$l'; s := '$41$42 C';)");
  EXPECT_FALSE(end.success());
  const char* const takes_more = "it takes digits and letters behind a code for a part of that";
  expect_told(end,
              {R"(other.st:3:26: STruC++ makes another text of "q$"q": write $0022 in the place of $")",
               "other.st:3:51: STruC++ ends the text '$C3$A4$00z' at the character $00",
               R"(other.st:4:6: STruC++ makes another text of "$$$"": write $0022 in the place of $")",
               R"(other.st:5:6: STruC++ makes another text of "it''s": it makes one ' of '')",
               R"(other.st:7:6: STruC++ makes another text of "$"a": it does not know $")",
               "other.st:9:6: STruC++ ends the text '$00' at the character $00",
               fmt::format(R"(other.st:6:6: STruC++ makes another text of "$0041B": {})", takes_more).c_str(),
               fmt::format("other.st:8:6: STruC++ makes another text of '$41B': {}", takes_more).c_str()});
  EXPECT_THAT(end.output, Not(HasSubstr("other.st:10:")));
}

}  // namespace
}  // namespace plchost::testing
