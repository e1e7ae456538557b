// Values that MATIEC's own library or STruC++ make wrong without a word: they are right, or the build tells
// of them.
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/adapters/run_program.hpp"
#include "tests/integration/instances/instance_process.hpp"
#include "tests/integration/instances/value_client.hpp"

namespace plchost::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class ValuesOfTranslatedText : public ::testing::Test {
 protected:
  void need(const char* variable) {
    const char* const folder = std::getenv(variable);
    if (folder == nullptr || *folder == '\0') GTEST_SKIP() << "needs " << variable;
  }
  /// A program Main, in a configuration of one task.
  ProgramEnd build(const std::string& variables, const std::string& statements, const std::string& compiler) {
    const std::string text = fmt::format(
        "PROGRAM Main\nVAR\n{}\nEND_VAR\n{}\nEND_PROGRAM\nCONFIGURATION cell RESOURCE press ON PLC\n"
        "TASK fast (INTERVAL := T#2ms, PRIORITY := 1); PROGRAM one WITH fast : Main;\nEND_RESOURCE "
        "END_CONFIGURATION\n",
        variables, statements);
    auto end = run_program({PLCCTL, "build", "application", sandbox.write("values.st", text), "-o",
                            sandbox.folder() + "/values.so", "--compiler", compiler},
                           sandbox.folder());
    return end ? *std::move(end) : ProgramEnd{};
  }

  Sandbox sandbox;
};

TEST_F(ValuesOfTranslatedText, ByMatiecAreThoseOfTheStandard) {
  need("PLCHOST_MATIEC");
  if (IsSkipped()) return;
  const ProgramEnd end = build(
      "ms : TIME := T#1ms; part : TIME := T#1.005s; half : TIME := T#500ms; sum : TIME; same : BOOL; less : "
      "TIME;\n"
      "many : TIME; later : DATE := D#2045-06-01; at1 : DT := DT#2040-01-01-00:00:01; day : TOD := "
      "TOD#23:59:58.001;\n"
      "t1, t2, t3, t4, t5 : STRING; text : STRING := 'ABCDEF'; found : INT;\n"
      "bits : BYTE := 16#0F; more : WORD := 16#FF; narrow, wide : BOOL; cycles : DINT;",
      "sum := half + half; same := sum = T#1s; less := T#1s - T#1ms; many := T#900ms * 3;\n"
      "t1 := REPLACE('ABC', 'xyz', 1, 2); t2 := DELETE(text, 300, 3); t3 := MID(text, 300, 5);\n"
      "t4 := INSERT(text, '-', 300); t5 := DELETE(text, 2, 0);\n"
      "found := FIND('AABAAB', 'AB'); narrow := (NOT bits) = BYTE#16#F0; wide := NOT (more OR 16#1) > more;\n"
      "cycles := cycles + 1;",
      "matiec");
  ASSERT_TRUE(end.success()) << end.output;
  InstanceProcess sut(sandbox, std::vector<std::string>{"--application", sandbox.folder() + "/values.so"});
  sut.wait_until_up();
  ValueClient client(sandbox);
  EXPECT_TRUE(eventually([&] { return client.read("one.cycles") != "0"; }));
  for (const auto& [name, value] : {std::pair{"ms", "T#1ms"},
                                    {"part", "T#1s5ms"},
                                    {"sum", "T#1s"},
                                    {"same", "TRUE"},
                                    {"less", "T#999ms"},
                                    {"many", "T#2s700ms"},
                                    {"later", "D#2045-06-01"},
                                    {"at1", "DT#2040-01-01-00:00:01"},
                                    {"day", "TOD#23:59:58.001"},
                                    {"t1", "'AxyzC'"},
                                    {"t2", "'AB'"},
                                    {"t3", "'EF'"},
                                    {"t4", "'ABCDEF-'"},
                                    {"t5", "''"},
                                    {"found", "2"},
                                    {"narrow", "TRUE"},
                                    {"wide", "TRUE"}}) {
    EXPECT_EQ(client.read(fmt::format("one.{}", name)), value) << name;
  }
}

TEST_F(ValuesOfTranslatedText, ByStrucppAreThoseOfTheStandard) {
  need("PLCHOST_STRUCPP");
  if (IsSkipped()) return;
  const std::string text =
      "TYPE Mode : (idle, busy); END_TYPE\n"
      "FUNCTION_BLOCK Adder\nVAR_TEMP part : INT := 5; grid : ARRAY[0..1] OF INT := [1, 2]; END_VAR\n"
      "VAR_OUTPUT sum : INT; END_VAR\n"
      "part := part + 1; grid[1] := grid[1] + part; sum := grid[1];\nEND_FUNCTION_BLOCK\n"
      "PROGRAM Main\nVAR_EXTERNAL shared : INT; END_VAR\n"
      "VAR t1 : STRING; text : STRING := 'ABCDE'; mode1 : Mode := Mode#busy; is_busy : BOOL; cycles : DINT;\n"
      "adder1 : Adder; marker AT %MW3 : INT; again AT %MB6 : BYTE; END_VAR\nVAR_TEMP own : INT := 4; "
      "END_VAR\n"
      "t1 := INSERT(text, 'xy', 2); text := TIME_TO_STRING(T#1s); text := 'ABCDE'; own := own + 1; shared := "
      "own;\n"
      "CASE mode1 OF Mode#idle: is_busy := FALSE; Mode#busy: is_busy := TRUE; END_CASE;\n"
      "adder1(); marker := 16#0102; cycles := cycles + 1;\nEND_PROGRAM\n"
      "PROGRAM Reader\nVAR marker AT %MW3 : INT; copy : INT; END_VAR\ncopy := marker; marker := "
      "7;\nEND_PROGRAM\n"
      "CONFIGURATION cell RESOURCE press ON PLC\nVAR_GLOBAL shared : INT; END_VAR\n"
      "TASK fast (INTERVAL := T#2ms, PRIORITY := 1); PROGRAM one WITH fast : Main;\n"
      "PROGRAM two WITH fast : Reader;\nEND_RESOURCE END_CONFIGURATION\n";
  const auto end = run_program({PLCCTL, "build", "application", sandbox.write("values.st", text), "-o",
                                sandbox.folder() + "/values.so", "--compiler", "strucpp"},
                               sandbox.folder());
  ASSERT_TRUE(end && end->success()) << end->output;
  EXPECT_THAT(end->output, HasSubstr("note: TIME_TO_STRING: STruC++ writes the number of nanoseconds"));
  InstanceProcess sut(sandbox, std::vector<std::string>{"--application", sandbox.folder() + "/values.so"});
  sut.wait_until_up();
  ValueClient client(sandbox);
  EXPECT_TRUE(eventually([&] {
    const std::string cycles = client.read("one.cycles");
    return cycles != "0" && cycles != "1" && client.read("two.copy") != "0";
  }));
  for (const auto& [name, value] : {std::pair{"one.t1", "'ABxyCDE'"},
                                    {"one.is_busy", "TRUE"},
                                    {"one.adder1.sum", "8"},
                                    {"shared", "5"},
                                    {"two.copy", "258"},
                                    {"two.marker", "7"}}) {
    EXPECT_EQ(client.read(name), value) << name;
  }
}

TEST_F(ValuesOfTranslatedText, OfAnEnumerationsTypeAreInitialOnesByStrucpp) {
  need("PLCHOST_STRUCPP");
  if (IsSkipped()) return;
  const std::string types =
      "TYPE Color : (red, green, blue) := green; Shade : Color; Tint : Shade;\n"
      "Box : STRUCT c : Color; d : Color := blue; e : ARRAY[0..1] OF Color; s : Shade; END_STRUCT;\n"
      "Row : ARRAY[1..2] OF Color; Plain : (none, some); Other : Plain; END_TYPE\n"
      "FUNCTION Its : Color VAR_INPUT set : BOOL; END_VAR IF set THEN Its := blue; END_IF; END_FUNCTION\n"
      "FUNCTION_BLOCK Lamp VAR_INPUT c : Color; END_VAR VAR_OUTPUT copy : Color; END_VAR copy := c; "
      "END_FUNCTION_BLOCK\n"
      "PROGRAM Main\nVAR c : Color; d : Color := blue; s : Shade; t : Tint; b : Box; a : ARRAY[1..2] OF "
      "Color;\n"
      "g : ARRAY[0..1, 1..2] OF Shade; row1 : Row; lamp1 : Lamp; f : Color; other1 : Other; cycles : DINT; "
      "number : INT; same, isGreen : BOOL; others : ARRAY[1..2] OF Plain; END_VAR\n"
      "lamp1(); f := Its(FALSE); same := a[1] = s; number := TO_INT(a[2]) + TO_INT(c); CASE a[2] OF green: "
      "isGreen := TRUE; END_CASE;\n"
      "cycles := cycles + 1;\nEND_PROGRAM\n"
      "CONFIGURATION cell VAR_GLOBAL gc : Color; gs : Shade; ga : ARRAY[1..2] OF Color; END_VAR\n"
      "RESOURCE press ON PLC TASK fast (INTERVAL := T#2ms, PRIORITY := 1); PROGRAM one WITH fast : Main;\n"
      "END_RESOURCE END_CONFIGURATION\n";
  const auto end = run_program({PLCCTL, "build", "application", sandbox.write("values.st", types), "-o",
                                sandbox.folder() + "/values.so", "--compiler", "strucpp"},
                               sandbox.folder());
  ASSERT_TRUE(end && end->success()) << end->output;
  InstanceProcess sut(sandbox, std::vector<std::string>{"--application", sandbox.folder() + "/values.so"});
  sut.wait_until_up();
  ValueClient client(sandbox);
  EXPECT_TRUE(eventually([&] { return client.read("one.cycles") != "0"; }));
  for (const char* const name :
       {"one.c", "one.s", "one.t", "one.b.C", "one.b.E[1]", "one.b.S", "one.a[2]", "one.g[1,2]",
        "one.row1[1]", "one.lamp1.c", "one.lamp1.copy", "one.f", "gc", "gs", "ga[2]"}) {
    EXPECT_EQ(client.read(name), "1") << name;
  }
  for (const auto& [name, value] : {std::pair{"one.d", "2"},
                                    {"one.b.D", "2"},
                                    {"one.same", "TRUE"},
                                    {"one.number", "2"},
                                    {"one.isGreen", "TRUE"},
                                    {"one.other1", "0"},
                                    {"one.others[2]", "0"}}) {
    EXPECT_EQ(client.read(name), value) << name;
  }
}

TEST_F(ValuesOfTranslatedText, OfInputsThatACallLeavesOutAreInitialOnesByStrucpp) {
  need("PLCHOST_STRUCPP");
  if (IsSkipped()) return;
  const std::string text =
      "FUNCTION Join : INT VAR_INPUT a : INT := 5; b : INT := 7; END_VAR Join := a * 10 + b; END_FUNCTION\n"
      "PROGRAM Main\nVAR i1, i2, i3, i4, cycles : DINT; t1, t2 : STRING; END_VAR\n"
      "i1 := Join(); i2 := Join(Join()); i3 := Join(1); i4 := Join(b := 1);\n"
      "t1 := CONCAT(LEFT('abc', 2), MID('xyz', 1, 2)); t2 := INSERT('ABCDE', 'xy', 2);\n"
      "cycles := FIND('abc', 'c') + LEN(CONCAT('a', 'b', 'c')) + STRING_TO_INT('123');\nEND_PROGRAM\n"
      "CONFIGURATION cell RESOURCE press ON PLC\n"
      "TASK fast (INTERVAL := T#2ms, PRIORITY := 1); PROGRAM one WITH fast : Main;\n"
      "END_RESOURCE END_CONFIGURATION\n";
  const auto end = run_program({PLCCTL, "build", "application", sandbox.write("values.st", text), "-o",
                                sandbox.folder() + "/values.so", "--compiler", "strucpp"},
                               sandbox.folder());
  ASSERT_TRUE(end && end->success()) << end->output;
  InstanceProcess sut(sandbox, std::vector<std::string>{"--application", sandbox.folder() + "/values.so"});
  sut.wait_until_up();
  ValueClient client(sandbox);
  EXPECT_TRUE(eventually([&] { return client.read("one.cycles") == "129"; }));
  for (const auto& [name, value] : {std::pair{"one.i1", "57"},
                                    {"one.i2", "577"},
                                    {"one.i3", "17"},
                                    {"one.i4", "51"},
                                    {"one.t1", "'aby'"},
                                    {"one.t2", "'ABxyCDE'"}}) {
    EXPECT_EQ(client.read(name), value) << name;
  }
}

TEST_F(ValuesOfTranslatedText, OfInputsThatACallOfAMethodLeavesOutAreInitialOnesByStrucpp) {
  need("PLCHOST_STRUCPP");
  if (IsSkipped()) return;
  const std::string text =
      "TYPE Mode : (idle, busy); END_TYPE\n"
      "FUNCTION_BLOCK Base\nVAR_OUTPUT own : INT; END_VAR\n"
      "METHOD PUBLIC Join : INT VAR_INPUT a : INT := 5; b : INT := 7; END_VAR Join := a * 10 + b; "
      "END_METHOD\n"
      "METHOD PUBLIC Inner : INT Inner := Join() + THIS.Join(1); THIS.Join(); END_METHOD\n"
      "METHOD PUBLIC Wait : TIME VAR_INPUT now : Mode := Mode.busy; END_VAR VAR_IN_OUT count : DINT; "
      "END_VAR\n"
      "VAR_INPUT pause : TIME := T#3s; END_VAR VAR_OUTPUT again : TIME; END_VAR count := count + 1; again := "
      "pause; IF now = Mode.busy THEN Wait := pause; END_IF; END_METHOD\n"
      "own := Join(b := 1);\nEND_FUNCTION_BLOCK\n"
      "FUNCTION_BLOCK Heir EXTENDS Base\n"
      "METHOD PUBLIC Above : INT Above := SUPER^.Join(2); END_METHOD\nSUPER^();\nEND_FUNCTION_BLOCK\n"
      "FUNCTION Ask : INT VAR_INPUT b : INT; END_VAR VAR asked : Base; END_VAR Ask := asked.Join(b); "
      "END_FUNCTION\n"
      "PROGRAM Main\nVAR heir1 : Heir; i1, i2, i3, i4, i5, i6, i7 : INT; cycles : DINT; t1, t2 : TIME; "
      "END_VAR\n"
      "heir1(); heir1.Join();\n"
      "i1 := heir1.Join(); i2 := heir1.Join(heir1.Join()); i3 := heir1.Join(b := 1); i4 := heir1.Join(a := "
      "1);\n"
      "i5 := heir1.Inner(); i6 := heir1.Above(); i7 := Ask(3);\n"
      "t1 := heir1.Wait(count := cycles, again => t2);\nEND_PROGRAM\n"
      "CONFIGURATION cell RESOURCE press ON PLC\n"
      "TASK fast (INTERVAL := T#2ms, PRIORITY := 1); PROGRAM one WITH fast : Main;\n"
      "END_RESOURCE END_CONFIGURATION\n";
  const auto end = run_program({PLCCTL, "build", "application", sandbox.write("values.st", text), "-o",
                                sandbox.folder() + "/values.so", "--compiler", "strucpp"},
                               sandbox.folder());
  ASSERT_TRUE(end && end->success()) << end->output;
  InstanceProcess sut(sandbox, std::vector<std::string>{"--application", sandbox.folder() + "/values.so"});
  sut.wait_until_up();
  ValueClient client(sandbox);
  EXPECT_TRUE(eventually([&] { return client.read("one.cycles") != "0"; }));
  for (const auto& [name, value] : {std::pair{"one.i1", "57"},
                                    {"one.i2", "577"},
                                    {"one.i3", "51"},
                                    {"one.i4", "17"},
                                    {"one.i5", "74"},
                                    {"one.i6", "27"},
                                    {"one.i7", "37"},
                                    {"one.heir1.own", "51"},
                                    {"one.t1", "T#3s"},
                                    {"one.t2", "T#3s"}}) {
    EXPECT_EQ(client.read(name), value) << name;
  }
}

// By itself it passes the arguments in the order of the call: without a word, if their number and types fit.
TEST_F(ValuesOfTranslatedText, OfMethodsThatStrucppCannotPassAreRefusedAtTheirPlace) {
  need("PLCHOST_STRUCPP");
  if (IsSkipped()) return;
  const std::string text =
      "FUNCTION_BLOCK Base\nVAR own : INT; limit : INT := 3; END_VAR\n"
      "METHOD PUBLIC Join : INT VAR_INPUT a : INT := 5; b : INT := 7; END_VAR Join := a * 10 + b; "
      "END_METHOD\n"
      "METHOD PUBLIC Need : INT VAR_INPUT a : INT; END_VAR VAR_OUTPUT o : INT; END_VAR Need := a; "
      "END_METHOD\n"
      "METHOD PUBLIC Next : Base VAR_INPUT a : INT := 5; END_VAR own := a; END_METHOD\n"
      "METHOD PUBLIC Most : INT VAR_INPUT a : INT := limit; END_VAR Most := a; END_METHOD\n"
      "own := 1;\nEND_FUNCTION_BLOCK\n"
      "PROGRAM Main\nVAR b : Base; i, limit : INT; END_VAR\n"
      "i := b.Join(b := 1) + b.Join(b := 2, a := 3);\n"
      "i := b.Need(o => i);\ni := b.Need(1);\ni := b.Join(c := 1);\ni := b.Join(1, 2, 3);\n"
      "i := b.Next().Join(1, 2);\ni := b.Most();\nb.Next(1).Join(1, 2);\nEND_PROGRAM\n"
      "CONFIGURATION cell RESOURCE press ON PLC\n"
      "TASK fast (INTERVAL := T#2ms, PRIORITY := 1); PROGRAM one WITH fast : Main;\n"
      "END_RESOURCE END_CONFIGURATION\n";
  const auto end = run_program({PLCCTL, "build", "application", sandbox.write("values.st", text), "-o",
                                sandbox.folder() + "/values.so", "--compiler", "strucpp"},
                               sandbox.folder());
  ASSERT_TRUE(end && !end->success());
  for (const char* const told :
       {"values.st:11:23: JOIN: STruC++ ignores the names in a call of a method; write them in the order of "
        "the declaration: A, B",
        "values.st:12:6: NEED: STruC++ wants each parameter in this call of a method; add A := ...",
        "values.st:13:6: NEED: STruC++ wants each parameter in this call of a method; add O => ...",
        "values.st:14:6: JOIN: it has no parameter C",
        "values.st:15:6: JOIN: this call has more arguments than the method has parameters",
        "values.st:16:6: NEXT: STruC++ wants each parameter in this call of a method; add A := ...",
        "values.st:17:6: MOST: STruC++ wants each parameter in this call of a method; add A := ..."}) {
    EXPECT_THAT(end->output, HasSubstr(told));
  }
  EXPECT_THAT(end->output, Not(HasSubstr("values.st:18:")));
}

TEST_F(ValuesOfTranslatedText, ThatStrucppCannotGiveAreToldInTheirColumn) {
  need("PLCHOST_STRUCPP");
  if (IsSkipped()) return;
  const std::string text =
      "TYPE Color : (red, green) := purple; END_TYPE\n"
      "FUNCTION Join : INT VAR_INPUT a : INT := 5; END_VAR VAR_OUTPUT o : INT; END_VAR\n"
      "VAR_INPUT b : INT := 7; END_VAR Join := a * 10 + b; o := 1; END_FUNCTION\n"
      "FUNCTION Plain : INT VAR_INPUT a : INT := 5; END_VAR Plain := a; END_FUNCTION\n"
      "PROGRAM Main\nVAR i : INT; t : TIME; END_VAR\n"
      "i := Plain() + Join(1);\ni := Plain() + Plain(); t := T#1_000ms;\nEND_PROGRAM\n"
      "CONFIGURATION cell RESOURCE press ON PLC\n"
      "TASK fast (INTERVAL := T#2ms, PRIORITY := 1); PROGRAM one WITH fast : Main;\n"
      "END_RESOURCE END_CONFIGURATION\n";
  const auto end = run_program({PLCCTL, "build", "application", sandbox.write("values.st", text), "-o",
                                sandbox.folder() + "/values.so", "--compiler", "strucpp"},
                               sandbox.folder());
  ASSERT_TRUE(end && !end->success());
  EXPECT_THAT(end->output, HasSubstr("values.st:1:6: PURPLE is no value of COLOR"));
  EXPECT_THAT(end->output, HasSubstr("values.st:7:16: JOIN: STruC++ makes zeros of inputs"));
  EXPECT_THAT(end->output, HasSubstr("values.st:8:30: STruC++ makes 0 ns of T#1_000ms"));
}

TEST_F(ValuesOfTranslatedText, OfDatesThatStrucppDoesNotConvertAreRefused) {
  need("PLCHOST_STRUCPP");
  if (IsSkipped()) return;
  const ProgramEnd end = build("d : DATE; e : DATE; o : TOD; w : DT; t : TIME; s : STRING; b : BOOL;",
                               "d := DT_TO_DATE(w); o := DATE_AND_TIME_TO_TOD(w);\nw := DATE_TO_DT(d);\nt := "
                               "d - e;\nb := STRING_TO_BOOL('FALSE');\n"
                               "w := w + T#1h; o := o - T#1h; t := T#2s - T#1s; b := STRING_TO_BOOL(s); d := "
                               "STRING_TO_DATE(s); b := d = e;",
                               "strucpp");
  EXPECT_FALSE(end.success());
  EXPECT_THAT(end.output, HasSubstr("values.st:5:6: DT_TO_DATE: STruC++ copies the number"));
  EXPECT_THAT(end.output, HasSubstr("values.st:5:26: DATE_AND_TIME_TO_TOD: STruC++ copies the number"));
  EXPECT_THAT(end.output, HasSubstr("values.st:6:6: DATE_TO_DT: STruC++ copies the number"));
  EXPECT_THAT(end.output, HasSubstr("values.st:7:6: STruC++ counts days here"));
  EXPECT_THAT(end.output, HasSubstr("values.st:8:6: STRING_TO_BOOL: STruC++ makes TRUE of each text"));
  EXPECT_THAT(end.output, Not(HasSubstr("values.st:9:")));
}

TEST_F(ValuesOfTranslatedText, ThatStrucppChangesAreRefusedAtTheirPlace) {
  need("PLCHOST_STRUCPP");
  if (IsSkipped()) return;
  const ProgramEnd end =
      build("l : LINT := 9007199254740993; t : TIME; pause : TIME := T#1_000ms;",
            "l := 9007199254740993;\nt := T#1.005s;\n(* \xF0\x9F\x99\x82 *) l := 9223372036854775807;\n"
            "l := LINT#9007199254740993; l := 16#7FFF_FFFF_FFFF_FFFF; t := T#1h2m3s4ms; t := T#2.5h;",
            "strucpp");
  EXPECT_FALSE(end.success());
  EXPECT_THAT(end.output, HasSubstr("values.st:3:57: STruC++ makes 0 ns of T#1_000ms"));
  EXPECT_THAT(end.output,
              HasSubstr("values.st:5:6: STruC++ makes 9007199254740992 of 9007199254740993; write it "
                        "with its type, as LINT#9007199254740993"));
  EXPECT_THAT(end.output, HasSubstr("values.st:6:6: STruC++ makes 1004999999.9999999 ns of T#1.005s"));
  EXPECT_THAT(end.output, HasSubstr("values.st:7:14: STruC++ makes")) << "a character is a column";
  EXPECT_THAT(end.output, Not(HasSubstr("values.st:8:")));
}

TEST_F(ValuesOfTranslatedText, LoopsThatStrucppDoesNotEndAreTold) {
  need("PLCHOST_STRUCPP");
  if (IsSkipped()) return;
  const ProgramEnd end =
      build("i : INT; u : USINT; s : INT := -1; n : INT;",
            "FOR u := 0 TO 255 DO n := 1; END_FOR;\nFOR i := 3 TO 1 BY s DO n := 1; END_FOR;\n"
            "FOR i := 0 TO -32768 BY -1 DO n := 1; END_FOR;\n"
            "FOR u := 3 TO 0 BY -1 DO n := 1; END_FOR;\n"
            "FOR i := 9 TO 0 BY -3 DO n := 1; END_FOR; FOR i := 0 TO 255 DO n := 1; END_FOR;",
            "strucpp");
  ASSERT_TRUE(end.success()) << end.output;
  for (const char* const told :
       {"values.st:5:1: note: this FOR does not end by itself",
        "values.st:6:1: note: STruC++ compares as if the step of this FOR were positive",
        "values.st:7:1: note: this FOR does not end by itself",
        "values.st:8:1: note: this FOR does not end by itself"}) {
    EXPECT_THAT(end.output, HasSubstr(told));
  }
  EXPECT_THAT(end.output, Not(HasSubstr("values.st:9:")));
}

}  // namespace
}  // namespace plchost::testing
