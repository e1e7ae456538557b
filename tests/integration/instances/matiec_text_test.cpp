// Programs that only MATIEC translates: instruction lists, sequential function charts, references of its own
// kind, and arrays whose bounds are constants.
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/instances/debugged_text.hpp"

namespace plchost::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class DebuggedByMatiec : public DebuggedText {
 protected:
  void run(const std::string& text) {
    said = build(text, sandbox_.folder() + "/press.so", "press.st");
    ASSERT_FALSE(HasFailure());
    start(sandbox_.folder() + "/press.so");
  }
  ControlReply change_to(const std::string& text) {
    said = build(text, sandbox_.folder() + "/next.so", "next.st");
    const ControlReply reply = process_->ask(ControlVerb::change_application, sandbox_.folder() + "/next.so");
    values_->open_table();
    return reply;
  }
  bool soon(const std::string& name, const std::string& value) {
    return eventually([&] { return values_->read(name) == value; });
  }

  std::string said;  // by the build
};

INSTANTIATE_TEST_SUITE_P(By, DebuggedByMatiec, ::testing::Values("matiec"),
                         [](const auto& compiler) { return compiler.param; });

constexpr const char* kEnd = R"(
CONFIGURATION cell
  RESOURCE line ON PLC
    TASK Main (INTERVAL := T#10ms, PRIORITY := 1);
    PROGRAM press1 WITH Main : Press;
  END_RESOURCE
END_CONFIGURATION
)";

constexpr const char* kInstructions = R"(FUNCTION_BLOCK Counter
  VAR_INPUT up : BOOL; END_VAR
  VAR_OUTPUT n : INT; END_VAR
  LD up
  JMPCN done
  LD n
  ADD 1
  ST n
done:
  LD n
END_FUNCTION_BLOCK

PROGRAM Press
  VAR one : Counter; go : BOOL := TRUE; twice : INT; END_VAR
  CAL one(
    up := go
  )
  LD one.n
  MUL 2
  ST twice
END_PROGRAM
)";

TEST_P(DebuggedByMatiec, RunsAnInstructionListAndHaltsAtItsLines) {
  ASSERT_NO_FATAL_FAILURE(run(std::string(kInstructions) + kEnd));
  attach();
  write("press1.one.n=100");
  EXPECT_TRUE(eventually([&] { return std::stoi(values_->read("press1.twice")) > 204; }));
  command("break press.st:8");
  ASSERT_TRUE(comes_to("Counter:8 Press:15")) << state().dump(2);
  EXPECT_EQ(innermost(), "press1.one");
  command("delete *");
  const int n = std::stoi(values_->read("press1.one.n"));
  EXPECT_EQ(stack_after("next"), "Counter:9 Press:15");
  EXPECT_EQ(values_->read("press1.one.n"), std::to_string(n + 1));
  EXPECT_EQ(stack_after("out"), "Press:18");
  EXPECT_EQ(stack_after("next"), "Press:19");
  EXPECT_EQ(stack_after("next"), "Press:20");
  write("press1.go=FALSE");
  EXPECT_EQ(stack_after("next"), "Press:15");
  EXPECT_EQ(values_->read("press1.twice"), std::to_string(2 * (n + 1)));
  EXPECT_EQ(stack_after("step"), "Counter:4 Press:15");
  EXPECT_EQ(stack_after("next"), "Counter:5 Press:15");
  EXPECT_EQ(stack_after("next"), "Counter:10 Press:15") << "it jumps";
  command("detach");
  EXPECT_TRUE(goes_on("Main"));
}

constexpr const char* kChart = R"(PROGRAM Press
  VAR go : BOOL; n : INT; rests : INT; END_VAR
  INITIAL_STEP Fill:
    Count(N);
  END_STEP
  STEP Rest:
    Sleep(N);
  END_STEP
  ACTION Count:
    n := n + 1;
  END_ACTION
  ACTION Sleep:
    rests := rests + 1;
    n := 0;
  END_ACTION
  TRANSITION FROM Fill TO Rest := go; END_TRANSITION
  TRANSITION FROM Rest TO Fill := NOT go; END_TRANSITION
END_PROGRAM
)";

TEST_P(DebuggedByMatiec, RunsASequentialFunctionChartAndHaltsInItsActions) {
  const std::string text = std::string(kChart) + kEnd;
  ASSERT_NO_FATAL_FAILURE(run(text));
  attach();
  EXPECT_TRUE(eventually([&] { return std::stoi(values_->read("press1.n")) > 3; }));
  EXPECT_EQ(values_->read("press1.rests"), "0");
  command("break press.st:13");
  write("press1.go=TRUE");
  ASSERT_TRUE(comes_to("Press:13")) << state().dump(2);
  EXPECT_EQ(innermost(), "press1");
  EXPECT_EQ(stack_after("next"), "Press:14");
  EXPECT_EQ(values_->read("press1.rests"), "1");
  command("delete *");
  command("continue Main");
  EXPECT_TRUE(soon("press1.n", "0"));
  EXPECT_TRUE(eventually([&] { return std::stoi(values_->read("press1.rests")) > 5; }));
  std::string other = text;
  other.replace(other.find("n + 1"), 5, "n + 7");
  const ControlReply changed = change_to(other);
  ASSERT_EQ(changed.code, ErrorCode::ok) << changed.text;
  EXPECT_EQ(values_->read("press1.n"), "0") << "the step Rest is still the active one";
  write("press1.go=FALSE");
  EXPECT_TRUE(eventually([&] { return std::stoi(values_->read("press1.n")) > 6; }));
}

constexpr const char* kReferences = R"(TYPE
  Place : REF_TO INT;
  Link : STRUCT target : REF_TO INT; weight : INT; END_STRUCT;
END_TYPE

FUNCTION_BLOCK Adder
  VAR_INPUT what : REF_TO INT; END_VAR
  VAR sum : DINT; END_VAR
  IF what <> NULL THEN
    sum := sum + INT_TO_DINT(what^);
  END_IF;
END_FUNCTION_BLOCK

PROGRAM Press
  VAR
    rate : INT := 2; seen : INT; place1 : Place; link1 : Link; many : ARRAY[1..2] OF REF_TO INT;
    adder1 : Adder; reckless : BOOL; empty : REF_TO INT;
  END_VAR
  VAR RETAIN kept : REF_TO INT; total : INT; END_VAR
  place1 := REF(rate);
  many[2] := place1;
  link1.target := many[2];
  link1.weight := 5;
  kept := REF(total);
  kept^ := kept^ + 1;
  adder1(what := REF(rate));
  seen := link1.target^ * link1.weight;
  IF reckless THEN
    seen := empty^;
  END_IF;
END_PROGRAM
)";

TEST_P(DebuggedByMatiec, FollowsReferencesThatBeginAnewInAnOnlineChange) {
  std::string text = std::string(kReferences) + kEnd;
  ASSERT_NO_FATAL_FAILURE(run(text));
  EXPECT_THAT(said, HasSubstr("kept is not carried out: it has references"));
  EXPECT_THAT(said, HasSubstr("press1.place1 cannot be seen from outside: it is a reference"));
  EXPECT_THAT(said, HasSubstr("press1.link1.TARGET cannot be seen from outside: it is a reference"));
  EXPECT_THAT(said, Not(HasSubstr("total is not carried out")));
  EXPECT_TRUE(soon("press1.seen", "10"));
  EXPECT_EQ(values_->read("press1.link1.weight"), "5");
  write("press1.rate=3");
  EXPECT_TRUE(soon("press1.seen", "15"));
  write("press1.adder1.sum=1000000");
  write("press1.total=1000");
  text.replace(text.find("seen := link1"), 4, "more := 4711; seen");
  text.replace(text.find("seen : INT;"), 11, "seen : INT; more : INT;");
  const ControlReply changed = change_to(text);
  ASSERT_EQ(changed.code, ErrorCode::ok) << changed.text;
  EXPECT_TRUE(soon("press1.more", "4711"));
  EXPECT_EQ(values_->read("press1.rate"), "3");
  EXPECT_EQ(values_->read("press1.seen"), "15") << "the references are those of the new version";
  write("press1.rate=4");
  EXPECT_TRUE(soon("press1.seen", "20"));
  EXPECT_GT(std::stoi(values_->read("press1.adder1.sum")), 999'999);
  EXPECT_GT(std::stoi(values_->read("press1.total")), 999);
  write("press1.reckless=TRUE");
  EXPECT_TRUE(eventually([&] { return process_->task("Main")->state == PageTaskState::exception; }))
      << "it follows a reference to nothing";
}

TEST_P(DebuggedByMatiec, KnowsTheWordsOfReferencesOnlyInProgramsThatHaveSome) {
  ASSERT_NO_FATAL_FAILURE(run(std::string("PROGRAM Press VAR ref, dref : INT; END_VAR ref := 3; dref := ref; "
                                          "END_PROGRAM") +
                              kEnd));
  EXPECT_TRUE(soon("press1.dref", "3"));
}

TEST_P(DebuggedByMatiec, KnowsPousThatAreCalledAsVariablesOfItsLibrary) {
  std::string text = std::string(
                         "FUNCTION_BLOCK M VAR_OUTPUT n : INT; END_VAR n := n + 1; END_FUNCTION_BLOCK "
                         "PROGRAM Press VAR one : M; count : INT; END_VAR one(); count := one.n; "
                         "END_PROGRAM") +
                     kEnd;
  ASSERT_NO_FATAL_FAILURE(run(text));
  EXPECT_TRUE(eventually([&] { return std::stoi(values_->read("press1.count")) > 3; }));
}

// The editors of Beremiz and OpenPLC write it into each program.
TEST_P(DebuggedByMatiec, LeavesOutTheCodeInPragmasThatNoProgramUses) {
  const std::string logger = R"(FUNCTION_BLOCK LOGGER
  VAR_INPUT TRIG : BOOL; MSG : STRING; END_VAR
  IF TRIG THEN
  {{
   LogMessage((char*)GetFbVar(MSG, .body),GetFbVar(MSG, .len));
  }}
  END_IF;
END_FUNCTION_BLOCK
)";
  ASSERT_NO_FATAL_FAILURE(run(logger + "PROGRAM Press VAR n : INT; END_VAR n := n + 1; END_PROGRAM" + kEnd));
  EXPECT_THAT(said, HasSubstr("FUNCTION_BLOCK LOGGER is not used by a program of the CONFIGURATION"));
  EXPECT_TRUE(eventually([&] { return std::stoi(values_->read("press1.n")) > 3; }));
}

// T_PLC_MS as the library OSCAT for OpenPLC has it, but for its cast to 32 bits.
constexpr const char* kTicks = R"(FUNCTION T_PLC_MS : ULINT
  VAR tx : ULINT; END_VAR
  VAR_INPUT debug : BOOL; END_VAR
  {extern unsigned long __tick;
  extern unsigned long long common_ticktime__;
  unsigned long long ticktime_ms = (common_ticktime__)/1000000;
  TX = ticktime_ms * (unsigned long long)__tick}
  T_PLC_MS := tx;
END_FUNCTION
FUNCTION Clock_us : ULINT
  VAR_INPUT debug : BOOL; END_VAR
  VAR us : ULINT; END_VAR
  {US = __CURRENT_TIME.tv_sec * 1000000ull + __CURRENT_TIME.tv_nsec / 1000;}
  Clock_us := us;
END_FUNCTION
PROGRAM Press
  VAR ms : ULINT; ahead : LINT; good, bad : DINT; END_VAR
  ms := T_PLC_MS(debug := FALSE);
  ahead := ULINT_TO_LINT(ms * 1000) - ULINT_TO_LINT(Clock_us(debug := FALSE));
  IF ahead > LEAST AND ahead < MOST THEN good := good + 1; ELSE bad := bad + 1; END_IF;
END_PROGRAM
CONFIGURATION cell
  RESOURCE line ON PLC
    TASK Main (INTERVAL := SHORT, PRIORITY := 1);
    TASK Slow (INTERVAL := LONG, PRIORITY := 2);
    PROGRAM press1 WITH Main : Press;
    PROGRAM press2 WITH Slow : Press;
  END_RESOURCE
END_CONFIGURATION
)";

std::string with(std::string text, const std::vector<std::pair<std::string, std::string>>& words) {
  for (const auto& [word, value] : words) text.replace(text.find(word), word.size(), value);
  return text;
}

// Ticks of 5 ms: the first one is cut, and later ones are rounded.
TEST_P(DebuggedByMatiec, CountsTicksByTheClockOfEachTask) {
  ASSERT_NO_FATAL_FAILURE(
      run(with(kTicks, {{"SHORT", "T#10ms"}, {"LONG", "T#25ms"}, {"LEAST", "-8000"}, {"MOST", "3000"}})));
  for (const std::string name : {"press1", "press2"}) {
    EXPECT_TRUE(eventually([&] { return std::stoi(values_->read(name + ".good")) > 20; })) << name;
    EXPECT_EQ(values_->read(name + ".bad"), "0") << values_->read(name + ".ahead");
    EXPECT_EQ(std::stoll(values_->read(name + ".ms")) % 5, 0);
  }
}

// The common divisor is 500 us: it would be 0 ms.
TEST_P(DebuggedByMatiec, CountsTicksOfAMillisecondIfIntervalsHaveParts) {
  ASSERT_NO_FATAL_FAILURE(
      run(with(kTicks, {{"SHORT", "T#1.5ms"}, {"LONG", "T#4ms"}, {"LEAST", "-2000"}, {"MOST", "1000"}})));
  for (const std::string name : {"press1", "press2"}) {
    EXPECT_TRUE(eventually([&] { return std::stoi(values_->read(name + ".good")) > 100; })) << name;
    EXPECT_EQ(values_->read(name + ".bad"), "0") << values_->read(name + ".ahead");
  }
}

TEST_P(DebuggedByMatiec, HasArraysWhoseBoundsAreConstants) {
  std::string text = std::string(R"(FUNCTION_BLOCK Total
  VAR_EXTERNAL CONSTANT last : INT; END_VAR
  VAR_INPUT given : INT; END_VAR
  VAR_OUTPUT sum : INT; END_VAR
  VAR_TEMP cells : ARRAY[2..last] OF INT; END_VAR
  cells[2] := given;
  cells[last] := 7;
  sum := cells[2] + cells[last];
END_FUNCTION_BLOCK
PROGRAM Press
  VAR_EXTERNAL CONSTANT last : INT; END_VAR
  VAR grid : ARRAY[0..1, 1..last] OF INT; total1 : Total; sum : INT; END_VAR
  grid[1, last] := 5;
  total1(given := grid[1, 3]);
  sum := total1.sum;
END_PROGRAM
)") + kEnd;
  text.replace(text.find("  RESOURCE"), 0, "  VAR_GLOBAL CONSTANT last : INT := 3; END_VAR\n");
  ASSERT_NO_FATAL_FAILURE(run(text));
  EXPECT_THAT(said, Not(HasSubstr("cannot be seen")));
  EXPECT_TRUE(soon("press1.grid[1,3]", "5"));
  EXPECT_TRUE(soon("press1.sum", "12"));
  attach();
  command("break Total:8");
  ASSERT_TRUE(halts("Main")) << state().dump(2);
  EXPECT_EQ(local(0, "cells[]"), "[5, 7]");
  command("detach");
  text.replace(text.find("last : INT := 3"), 15, "last : INT := 4");
  const ControlReply changed = change_to(text);
  EXPECT_EQ(changed.code, ErrorCode::refused) << changed.text;
  EXPECT_THAT(changed.text, HasSubstr("press1.grid"));
}

}  // namespace
}  // namespace plchost::testing
