// A debug build of Structured Text, by way of each compiler that is there.
#include <algorithm>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/instances/debugged_text.hpp"

namespace plchost::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(By, DebuggedText, ::testing::Values("matiec", "strucpp"),
                         [](const auto& compiler) { return compiler.param; });

/// For programs that only that compiler translates.
class DebuggedMethods : public DebuggedText {};
INSTANTIATE_TEST_SUITE_P(By, DebuggedMethods, ::testing::Values("strucpp"),
                         [](const auto& compiler) { return compiler.param; });

constexpr const char* kPress = R"(FUNCTION Twice : INT
  VAR_INPUT x : INT; END_VAR
  Twice := x * 2;
END_FUNCTION

FUNCTION_BLOCK Counter
  VAR_INPUT up : BOOL; END_VAR
  VAR_OUTPUT n : INT; END_VAR
  IF up THEN
    n := n + 1;
  END_IF;
END_FUNCTION_BLOCK

PROGRAM Press
  VAR one : Counter; two : Counter; total : INT; END_VAR
  one(up := TRUE);
  two(up := one.n > 5);
  IF total > 1000 THEN
    total := 0;
  ELSE
    total := Twice(two.n);
  END_IF;
END_PROGRAM

CONFIGURATION cell
  RESOURCE line ON PLC
    TASK Main (INTERVAL := T#10ms, PRIORITY := 1);
    PROGRAM press1 WITH Main : Press;
  END_RESOURCE
END_CONFIGURATION
)";

TEST_P(DebuggedText, HaltsByItsLines) {
  ASSERT_NO_FATAL_FAILURE(build_and_attach(kPress));
  command("break Press:16");
  ASSERT_TRUE(halts("Main")) << state().dump(2);
  EXPECT_EQ(stack("Main"), "Press:16");
  EXPECT_EQ(innermost(), "press1");
  write("press1.one.n=100");
  write("press1.two.n=200");
  command("delete *");
  const auto made = command("break press.st:8 if n > 150");
  EXPECT_EQ(made.value("pou", ""), "Counter");
  EXPECT_EQ(made.value("line", 0), 9);
  EXPECT_EQ(made.value("remark", "x"), "");
  command("continue Main");
  // The names of a function block are those of the instance that comes there.
  EXPECT_TRUE(comes_to("Counter:9 Press:17")) << state().dump(2);
  EXPECT_EQ(innermost(), "press1.two");
  EXPECT_EQ(values_->read("press1.one.n"), "101");
  command("delete *");
  command("until Main Twice:3");
  EXPECT_TRUE(comes_to("Twice:3 Press:21")) << state().dump(2);
  command("detach");
  EXPECT_TRUE(goes_on("Main"));
}

TEST_P(DebuggedText, IsSteppedIntoOverAndOutOf) {
  ASSERT_NO_FATAL_FAILURE(build_and_attach(kPress));
  command("break Press:16");
  ASSERT_TRUE(halts("Main")) << state().dump(2);
  command("delete *");
  write("press1.one.n=7");
  write("press1.total=3");
  EXPECT_EQ(stack_after("step"), "Counter:9 Press:16");
  EXPECT_EQ(stack_after("next"), "Counter:10 Press:16");
  EXPECT_EQ(stack_after("out"), "Press:17");
  EXPECT_EQ(values_->read("press1.one.n"), "8");
  EXPECT_EQ(stack_after("next"), "Press:18");
  EXPECT_EQ(stack_after("next"), "Press:21");
  EXPECT_EQ(stack_after("step"), "Twice:3 Press:21");
  EXPECT_EQ(stack_after("out"), "Press:16");
  command("detach");
  EXPECT_TRUE(goes_on("Main"));
}

constexpr const char* kSums = R"(FUNCTION Twice : INT
  VAR_INPUT x : INT; END_VAR
  Twice := x * 2;
END_FUNCTION

FUNCTION Again : INT
  VAR_INPUT x : INT; END_VAR
  Again := Twice(x);
END_FUNCTION

PROGRAM Press
  VAR sum : INT; i : INT; cells : ARRAY[1..5] OF INT; END_VAR
  sum := Again(1) + Again(2);
  FOR i := 1 TO 5 DO
    cells[i] := sum;
  END_FOR;
  sum := 0; sum := sum + i;
  i := 0;
END_PROGRAM

CONFIGURATION cell
  RESOURCE line ON PLC
    TASK Main (INTERVAL := T#10ms, PRIORITY := 1);
    PROGRAM press1 WITH Main : Press;
  END_RESOURCE
END_CONFIGURATION
)";

TEST_P(DebuggedText, IsSteppedOverToItsCallerAndToNoOtherCall) {
  ASSERT_NO_FATAL_FAILURE(build_and_attach(kSums));
  command("break Twice:3");  // compilers choose which call is the first
  ASSERT_TRUE(halts("Main")) << state().dump(2);
  command("delete *");
  EXPECT_EQ(stack("Main"), "Twice:3 Again:8 Press:13");
  EXPECT_EQ(stack_after("next"), "Press:14") << "the other calls of this line are neither";
}

TEST_P(DebuggedText, IsSteppedIntoTheNextCallOfItsLine) {
  ASSERT_NO_FATAL_FAILURE(build_and_attach(kSums));
  command("break Twice:3");  // compilers choose which call is the first
  ASSERT_TRUE(halts("Main")) << state().dump(2);
  command("delete *");
  EXPECT_EQ(stack_after("step"), "Again:8 Press:13");
  EXPECT_EQ(stack_after("step"), "Twice:3 Again:8 Press:13");
  EXPECT_EQ(stack_after("out"), "Press:14");
}

TEST_P(DebuggedText, IsSteppedThroughEachRunOfALoop) {
  ASSERT_NO_FATAL_FAILURE(build_and_attach(kSums));
  command("break Press:14");
  ASSERT_TRUE(halts("Main")) << state().dump(2);
  command("delete *");
  for (const char* const run : {"1", "2", "3", "4", "5"}) {
    EXPECT_EQ(stack_after(*run == '2' ? "step" : "next"), "Press:15");
    EXPECT_EQ(values_->read("press1.i"), run);
  }
  EXPECT_EQ(stack_after("next"), "Press:17");
  EXPECT_EQ(stack_after("next"), "Press:18") << "the statements of one line are one step";
}

constexpr const char* kScale = R"(TYPE
  Mode : (idle, busy, late);
  Place : STRUCT x : INT; far : BOOL; END_STRUCT;
END_TYPE

FUNCTION Scale : INT
  VAR_INPUT value : INT; END_VAR
  VAR_IN_OUT calls : INT; END_VAR
  VAR factor : INT := 2; wait : TIME; gear : Mode; text : STRING; at_x : Place; END_VAR
  FOR factor := 1 TO 2 DO
    wait := T#1s500ms;
  END_FOR;
  text := 'run';
  gear := busy;
  at_x.x := value;
  factor := 2;
  calls := calls + 1;
  Scale := value * factor;
END_FUNCTION

FUNCTION_BLOCK Adder
  VAR_INPUT width : INT; END_VAR
  VAR_IN_OUT sum : INT; END_VAR
  VAR_TEMP twice : INT; END_VAR
  twice := Scale(value := width, calls := sum);
  sum := sum + twice;
END_FUNCTION_BLOCK

PROGRAM Press
  VAR one : Adder; total : INT; value : INT := 5; END_VAR
  total := 0;
  one(width := 4, sum := total);
  one(width := value, sum := total);
  total := total + 0;
END_PROGRAM

CONFIGURATION cell
  RESOURCE line ON PLC
    TASK Main (INTERVAL := T#10ms, PRIORITY := 1);
    PROGRAM press1 WITH Main : Press;
  END_RESOURCE
END_CONFIGURATION
)";

TEST_P(DebuggedText, HasLocalVariablesInEachCall) {
  ASSERT_NO_FATAL_FAILURE(build_and_attach(kScale));
  const auto made =
      command("break Scale:18 if value = 5 AND factor < value AND at_x.x = 5 log {calls} calls");
  EXPECT_EQ(made.value("remark", "x"), "");
  EXPECT_TRUE(eventually([&] { return !state()["log"].empty(); }));
  EXPECT_EQ(state()["log"][0].value("text", ""), "10 calls") << "of the second call: 1 + 8 + 1";
  command("delete *");
  command("break Scale:18 if value = 5");
  ASSERT_TRUE(comes_to("Scale:18 Adder:25 Press:33")) << state().dump(2);
  command("delete *");
  EXPECT_EQ(local(0, "value"), "5");
  EXPECT_EQ(local(0, "calls"), "10");
  EXPECT_EQ(local(0, "factor"), "2");
  EXPECT_EQ(local(0, "wait"), "T#1s500ms");
  EXPECT_EQ(local(0, "gear"), "1");
  EXPECT_EQ(local(0, "text"), "'run'");
  EXPECT_EQ(local(0, "at_x.x"), "5");
  EXPECT_EQ(local(0, "at_x.far"), "FALSE");
  EXPECT_EQ(local(0, "Scale"), "0");
  EXPECT_NE(local(1, "twice"), "none");
  EXPECT_EQ(local(2, "value"), "none") << "that of a program is no local variable";
  command("local Main 0 factor=10");
  command("local Main 0 text='walk'");
  EXPECT_EQ(local(0, "text"), "'walk'");
  EXPECT_THAT(refused("local Main 0 value=40000"), ::testing::HasSubstr("32767"));
  EXPECT_EQ(stack_after("out"), "Adder:26 Press:33");
  EXPECT_EQ(local(0, "twice"), "50");
  command("local Main 0 twice=100");
  EXPECT_EQ(stack_after("out"), "Press:34");
  EXPECT_EQ(values_->read("press1.total"), "110") << "10 + 100";
}

constexpr const char* kRows = R"(TYPE
  Row : ARRAY [1..3] OF INT;
  Site : STRUCT x : INT; far : BOOL; END_STRUCT;
  Spots : ARRAY [1..2] OF Site;
  Gear : (idle, busy);
  Gears : ARRAY [0..1] OF Gear;
  Grid : ARRAY [0..1, 2..4] OF DINT;
  Texts : ARRAY [1..2] OF STRING;
  Clocks : ARRAY [1..2] OF TIME_OF_DAY;
END_TYPE

FUNCTION Total : INT
  VAR_INPUT given : INT; END_VAR
  VAR
    i : INT; twice : Row; spot : Spots; shift : Gears; cells : Grid; words : Texts; dawn : Clocks;
  END_VAR
  FOR i := 1 TO 3 DO
    twice[i] := given * i;
  END_FOR;
  spot[2].x := 21;
  spot[2].far := TRUE;
  shift[1] := busy;
  cells[1, 3] := 13;
  words[2] := 'two';
  dawn[2] := TOD#1:02:03;
  Total := twice[1] + twice[2] + twice[3];
END_FUNCTION

FUNCTION_BLOCK Mover
  VAR_IN_OUT io : Row; END_VAR
  VAR n : INT; END_VAR
  n := n + 1;
  io[3] := n;
END_FUNCTION_BLOCK

PROGRAM Press
  VAR one : Mover; line : Row; sum : INT; END_VAR
  line[1] := 4;
  line[2] := 5;
  one(io := line);
  sum := Total(given := line[3]);
  sum := sum + 0;
END_PROGRAM

CONFIGURATION cell
  RESOURCE res ON PLC
    TASK Main (INTERVAL := T#10ms, PRIORITY := 1);
    PROGRAM press1 WITH Main : Press;
  END_RESOURCE
END_CONFIGURATION
)";

TEST_P(DebuggedText, HasArraysAmongLocalVariables) {
  ASSERT_NO_FATAL_FAILURE(build_and_attach(kRows));
  EXPECT_EQ(command("break Total:26 if twice[2] > 5 AND given > 2").value("remark", "x"), "");
  ASSERT_TRUE(comes_to("Total:26 Press:41")) << state().dump(2);
  const int given = std::stoi(local(0, "given"));
  EXPECT_GT(given, 2);
  EXPECT_EQ(local(0, "twice[]"), fmt::format("[{}, {}, {}]", given, 2 * given, 3 * given));
  EXPECT_EQ(local(0, "spot[].x"), "[0, 21]");
  EXPECT_EQ(local(0, "spot[].far"), "[FALSE, TRUE]");
  EXPECT_EQ(local(0, "shift[]"), "[0, 1]");
  EXPECT_EQ(local(0, "cells[][]"), "[0, 0, 0, 0, 13, 0]");
  EXPECT_EQ(local(0, "words[]"), "['', 'two']");
  EXPECT_EQ(local(0, "dawn[]"), "[TOD#00:00:00, TOD#01:02:03]");
  EXPECT_THAT(refused("local Main 0 twice[4]=1"), ::testing::HasSubstr("1 to 3"));
  command("local Main 0 twice[3]=1000");
  command("local Main 0 spot[1].x=7");
  EXPECT_EQ(local(0, "spot[].x"), "[7, 21]");
  EXPECT_EQ(stack_after("out"), "Press:42");
  EXPECT_EQ(values_->read("press1.sum"), std::to_string(3 * given + 1000));
}

TEST_P(DebuggedText, HasArraysThatItsBlocksAreGiven) {
  ASSERT_NO_FATAL_FAILURE(build_and_attach(kRows));
  EXPECT_EQ(command("break Mover:32 if io[2] = 5").value("remark", "x"), "");
  ASSERT_TRUE(comes_to("Mover:32 Press:40")) << state().dump(2);
  if (GetParam() == "matiec") {
    EXPECT_EQ(local(0, "io[]").substr(0, 5), "[4, 5");
    command("local Main 0 io[2]=50");
  } else {
    write("press1.one.io[2]=50");  // with STruC++ it is a variable that has a whole name
  }
  EXPECT_EQ(stack_after("out"), "Press:41");
  EXPECT_EQ(values_->read("press1.line[2]"), "50");
}

// Its statements stand on other lines in the text that the build makes of it.
constexpr const char* kPressInXml = R"(<?xml version='1.0' encoding='utf-8'?>
<project xmlns='http://www.plcopen.org/xml/tc6_0201' xmlns:xhtml='http://www.w3.org/1999/xhtml'>
<fileHeader companyName='a'/><contentHeader name='b'/>
<types><dataTypes/><pous>
<pou name='Counter' pouType='functionBlock'>
<interface>
<inputVars><variable name='up'><type><BOOL/></type></variable></inputVars>
<outputVars><variable name='n'><type><INT/></type></variable></outputVars>
</interface>
<body><ST><xhtml:p><![CDATA[
IF up THEN
  n := n + 1;
END_IF;
]]></xhtml:p></ST></body>
</pou>
<pou name='Press' pouType='program'>
<interface><localVars>
<variable name='one'><type><derived name='Counter'/></type></variable>
<variable name='cells'><type><array><dimension lower='1' upper='3'/><baseType><INT/></baseType></array></type></variable>
<variable name='place'><type><INT/></type><initialValue><simpleValue value='1'/></initialValue></variable>
</localVars></interface>
<body>
<ST><xhtml:p>one(up := place &lt; 9);

cells[place] := one.n;
place := place + 0;</xhtml:p></ST>
</body>
</pou>
</pous></types>
<instances><configurations><configuration name='cell'><resource name='line'>
<task name='Main' interval='T#10ms' priority='1'><pouInstance name='press1' typeName='Press'/></task>
</resource></configuration></configurations></instances></project>
)";

unsigned line_of(std::string_view words) {
  const std::string_view text = kPressInXml;
  return static_cast<unsigned>(1 + std::ranges::count(text.substr(0, text.find(words)), '\n'));
}

TEST_P(DebuggedText, OfAProjectOfPlcopenHaltsByTheLinesOfItsFile) {
  ASSERT_NO_FATAL_FAILURE(build_and_attach(kPressInXml, "project.xml"));
  const unsigned counts = line_of("n := n + 1");
  const unsigned calls = line_of("one(up");
  const unsigned fills = line_of("cells[place]");
  const auto made = command(fmt::format("break project.xml:{}", counts));
  EXPECT_EQ(made.value("pou", ""), "Counter");
  EXPECT_EQ(made.value("line", 0U), counts);
  ASSERT_TRUE(comes_to(fmt::format("Counter:{} Press:{}", counts, calls))) << state().dump(2);
  EXPECT_THAT(task("Main")["stack"][0].value("file", ""), ::testing::EndsWith("project.xml"));
  EXPECT_EQ(stack_after("out"), fmt::format("Press:{}", fills));
  EXPECT_EQ(stack_after("next"), fmt::format("Press:{}", line_of("place := place")));
  command("delete *");
  EXPECT_EQ(command(fmt::format("break project.xml:{}", calls + 1)).value("line", 0U), fills)
      << "the next statement from an empty line on";
  EXPECT_THAT(refused(fmt::format("break project.xml:{}", line_of("<instances>"))),
              ::testing::HasSubstr("has no statement from line"));
}

constexpr const char* kLine = R"(FUNCTION_BLOCK Pump
  VAR hours : INT; END_VAR
  METHOD Reset : BOOL
    VAR_INPUT value : INT; END_VAR
    hours := value;
    Reset := TRUE;
  END_METHOD
  hours := hours + 1;
END_FUNCTION_BLOCK

PROGRAM Line
  VAR one, two : Pump; i : INT; cells : ARRAY[0..9] OF INT; place : INT; done : BOOL; END_VAR
  FOR i := 1 TO 3 DO
    one();
  END_FOR;
  CASE place OF
    0:
      cells[0] := 1;
    1, 3..5:
      done := two.Reset(value := 40);
  ELSE
    cells[place] := 2;
  END_CASE;
END_PROGRAM

CONFIGURATION cell
  RESOURCE line ON PLC
    TASK Main (INTERVAL := T#10ms, PRIORITY := 1);
    PROGRAM line1 WITH Main : Line;
  END_RESOURCE
END_CONFIGURATION
)";

TEST_P(DebuggedMethods, AreStatementsOfTheirBlock) {
  ASSERT_NO_FATAL_FAILURE(build_and_attach(kLine));
  EXPECT_EQ(command("break Pump:8 if line1.i = 2 AND hours > 1").value("remark", "x"), "");
  EXPECT_TRUE(comes_to("Pump:8 Line:14")) << state().dump(2);
  EXPECT_EQ(innermost(), "line1.one");
  EXPECT_EQ(values_->read("line1.i"), "2");
  command("delete *");
  write("line1.place=4");
  EXPECT_EQ(stack_after("out"), "Line:14");
  EXPECT_EQ(values_->read("line1.i"), "3");
  EXPECT_EQ(stack_after("next"), "Line:16");
  EXPECT_EQ(stack_after("next"), "Line:20");
  EXPECT_EQ(stack_after("step"), "Pump:5 Line:20");
  EXPECT_EQ(innermost(), "line1.two");
  EXPECT_EQ(stack_after("next"), "Pump:6 Line:20");
  EXPECT_EQ(values_->read("line1.two.hours"), "40");
  EXPECT_EQ(stack_after("out"), "Line:13");
}

TEST_P(DebuggedMethods, HaveLocalVariablesOfTheirOwn) {
  ASSERT_NO_FATAL_FAILURE(build_and_attach(kLine));
  EXPECT_EQ(command("break Pump:5 if value = 40").value("remark", "x"), "");
  write("line1.place=4");
  ASSERT_TRUE(comes_to("Pump:5 Line:20")) << state().dump(2);
  EXPECT_EQ(local(0, "value"), "40");
  EXPECT_EQ(local(0, "Reset"), "FALSE");
  command("local Main 0 value=41");
  EXPECT_EQ(stack_after("next"), "Pump:6 Line:20");
  EXPECT_EQ(values_->read("line1.two.hours"), "41");
  EXPECT_THAT(refused("break Pump:8 if value = 40"), ::testing::HasSubstr("value"));
}

// The library throws out of the frames.
TEST_P(DebuggedMethods, EndInTheExceptionsOfTheirProgram) {
  ASSERT_NO_FATAL_FAILURE(build_and_attach(kLine));
  command("break Line:22");
  write("line1.place=77");
  EXPECT_TRUE(comes_to("Line:22")) << state().dump(2);
  command("continue Main");
  EXPECT_TRUE(eventually([&] { return process_->task("Main")->state == PageTaskState::exception; }))
      << process_->log();
  EXPECT_EQ(process_->ask(ControlVerb::status).code, ErrorCode::ok);
  EXPECT_THAT(process_->log(), ::testing::HasSubstr("out of bounds"));
}

}  // namespace
}  // namespace plchost::testing
