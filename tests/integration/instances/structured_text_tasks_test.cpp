// Tasks and globals of a program in Structured Text that have more than IEC 61131-3 has words for: the task
// file, from its text to the instance that runs.
#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/instances/structured_text_fixture.hpp"

namespace plchost::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class TextWithATaskFile : public TranslatedText {};

INSTANTIATE_TEST_SUITE_P(By, TextWithATaskFile, ::testing::Values("matiec", "strucpp"),
                         [](const auto& compiler) { return compiler.param; });

// A long task that sees globals of a short one, in several places.
constexpr const char* kCopied = R"(
FUNCTION_BLOCK Part
  VAR_EXTERNAL a : DINT; rows : ARRAY[0..3] OF DINT; END_VAR
  VAR_OUTPUT seen : DINT; END_VAR
  seen := a;
  rows[1] := rows[1] + 1;
END_FUNCTION_BLOCK
PROGRAM Slow
  VAR_EXTERNAL a : DINT; b : DINT; done : DINT; rows : ARRAY[0..3] OF DINT; END_VAR
  VAR here : Part; first : DINT; i : DINT; work : DINT; END_VAR
  VAR changed AT %QD1 : DINT; cycles AT %QD2 : DINT; END_VAR
  first := a;
  IF a <> b THEN changed := changed + 1; END_IF;
  FOR i := 0 TO 500000 DO work := work + i; END_FOR;
  here();
  IF a <> first OR b <> first OR here.seen <> first THEN changed := changed + 1; END_IF;
  cycles := cycles + 1;
  done := cycles;
END_PROGRAM
PROGRAM Fast
  VAR_EXTERNAL a : DINT; b : DINT; done : DINT; rows : ARRAY[0..3] OF DINT; END_VAR
  VAR all AT %QX0.0 : BOOL; cycles AT %QD3 : DINT; END_VAR
  a := a + 1;
  rows[2] := rows[2] + 1;
  b := a;
  cycles := cycles + 1;
  all := done > 100 AND rows[1] > 100 AND rows[2] = cycles AND rows[1] >= done;
END_PROGRAM
CONFIGURATION cell
  VAR_GLOBAL a : DINT; b : DINT; done : DINT; rows : ARRAY[0..3] OF DINT; END_VAR
  RESOURCE press ON PLC
    TASK quick (INTERVAL := T#1ms, PRIORITY := 1);
    TASK idle (INTERVAL := T#5ms, PRIORITY := 5);
    PROGRAM one WITH quick : Fast;
    PROGRAM two WITH idle : Slow;
  END_RESOURCE
END_CONFIGURATION
)";

TEST_P(TextWithATaskFile, SeesGlobalsOfOneMomentIfItHasCopies) {
  const ProgramEnd shared = build(kCopied, "copied");
  ASSERT_TRUE(shared.success()) << shared.output;
  EXPECT_THAT(shared.output, HasSubstr("the tasks quick, idle use a and can pre-empt each other"));
  start(so("copied"));
  EXPECT_TRUE(eventually([&] { return outputs<Interrupted>().lost > 0; })) << "without copies a changes";
  sut.reset();
  (void)sandbox.write("copied.toml", "[program.one]\nglobals = 'copy'\n[program.two]\nglobals = 'copy'\n");
  const ProgramEnd copied = build(kCopied, "copied");
  ASSERT_TRUE(copied.success()) << copied.output;
  EXPECT_THAT(copied.output, Not(HasSubstr("can pre-empt each other")));
  start(so("copied"));
  EXPECT_TRUE(eventually([&] { return outputs<Interrupted>().slow > 300; }));
  EXPECT_EQ(outputs<Interrupted>().lost, 0);
  EXPECT_TRUE(eventually([&] { return (outputs<Interrupted>().bits & 1) != 0; }))
      << "all changes of each reach the other one, also elements of one array";
}

TEST_P(TextWithATaskFile, HasTheTasksOfAFileBesideIt) {
  constexpr const char* kCounts = R"(
PROGRAM Posted VAR posts AT %QB8 : USINT; END_VAR posts := posts + 1; END_PROGRAM
PROGRAM Cyclic VAR twice AT %QW1 : INT; END_VAR twice := 7; END_PROGRAM
CONFIGURATION cell RESOURCE press ON PLC
  TASK done (PRIORITY := 2);
  TASK fast (INTERVAL := T#2ms, PRIORITY := 1);
  PROGRAM one WITH done : Posted;
  PROGRAM two WITH fast : Cyclic;
END_RESOURCE END_CONFIGURATION
)";
  EXPECT_THAT(build(kCounts).output, HasSubstr("TASK done has neither INTERVAL nor SINGLE"));
  const std::string file = sandbox.write("twice.toml",
                                         "[task.Done]\nexternal_event = 'product'\nwatchdog_time = '1s'\n"
                                         "[task.fast]\nstart_offset = '250us'\n");
  const ProgramEnd built = build(kCounts);
  ASSERT_TRUE(built.success()) << built.output;
  EXPECT_THAT(built.output, HasSubstr("twice.toml: note: is read as the task file of "));
  start(sandbox.folder() + "/twice.so");
  EXPECT_TRUE(eventually([&] { return outputs().twice == 7; }));
  EXPECT_EQ(outputs().posts, 0);
  PoolEvent product = sut->event("product");
  EXPECT_EQ(product.post(), PostResult::posted);
  EXPECT_TRUE(eventually([&] { return outputs().posts == 1; }));
  EXPECT_EQ(product.post(), PostResult::posted);
  EXPECT_TRUE(eventually([&] { return outputs().posts == 2; }));
  (void)sandbox.write("twice.toml", "[task.done]\nexternal_event = 'product'\nlate_policy = 'asap'\n");
  EXPECT_THAT(build(kCounts).output,
              HasSubstr("twice.toml:3:1: task done late_policy: this task is not cyclic"));
}

// An online change compares the tasks that run with those of the new version, option by option.
TEST_P(TextWithATaskFile, HasEachOptionOfItsTaskFile) {
  constexpr const char* kTwoTasks = R"(
PROGRAM Counted VAR_EXTERNAL twice : INT; END_VAR twice := 7; END_PROGRAM
CONFIGURATION cell VAR_GLOBAL twice AT %QW1 : INT; END_VAR RESOURCE press ON PLC
  TASK done (INTERVAL := T#3ms, PRIORITY := 2);
  TASK fast (INTERVAL := T#2ms, PRIORITY := 1);
  PROGRAM one WITH done : Counted;
  PROGRAM two WITH fast : Counted;
END_RESOURCE END_CONFIGURATION
)";
  ASSERT_TRUE(build(kTwoTasks).success());
  start(so("twice"));
  EXPECT_TRUE(eventually([&] { return outputs().twice == 7; }));
  (void)sandbox.write("other.toml",
                      "[task.done]\nexternal_event = 'product'\n"
                      "[task.fast]\nstart_offset = '250us'\nlate_policy = 'asap'\ndrives_outputs = true\n"
                      "watchdog_time = '7ms'\nwatchdog_sensitivity = 3\nwatchdog_omitted_cycles = 4\n"
                      "watchdog_policy = 'task'\n");
  const ProgramEnd built = build(kTwoTasks, "other");
  ASSERT_TRUE(built.success()) << built.output;
  const ControlReply refused = sut->ask(ControlVerb::change_application, so("other"));
  EXPECT_EQ(refused.code, ErrorCode::refused);
  for (const char* const option :
       {"start offset", "LatePolicy=Asap", "DrivesOutputs", "watchdog's time", "watchdog's sensitivity",
        "watchdog's omitted cycles", "watchdog's Policy=Task", "its kind is external"})
    EXPECT_THAT(refused.text, HasSubstr(option));
  start(so("other"), "cold");
  EXPECT_TRUE(eventually([&] { return sut->task("fast")->counters.cycles > 100; }));
  EXPECT_EQ(sut->task("done")->counters.cycles, 0U);
  (void)sandbox.write("other.toml", "scheduler = 'CmpScheduleTimer'\n");
  ASSERT_TRUE(build(kTwoTasks, "other").success());
  sut.reset();
  start(so("other"));
  EXPECT_EQ(sut->runtime().scheduler.view(), "CmpScheduleTimer");
}

// The edge is that of the area. As long as the idle task may be in its cycle, the flag is a value within
// that.
TEST_P(TextWithATaskFile, PutsOutTheMemoryOfATaskThatWasStoppedInItsCycle) {
  constexpr const char* kStopped = R"(
PROGRAM Slow VAR_EXTERNAL flag : BOOL; END_VAR VAR go AT %IX0.0 : BOOL; zero : INT; END_VAR
  IF go THEN flag := TRUE; zero := 10 / zero; END_IF;
END_PROGRAM
PROGRAM Fast VAR_EXTERNAL flag : BOOL; END_VAR VAR twice AT %QW1 : INT; END_VAR
  IF flag THEN twice := 7; END_IF;
END_PROGRAM
PROGRAM Edge VAR edges AT %QB4 : USINT; END_VAR edges := edges + 1; END_PROGRAM
CONFIGURATION cell VAR_GLOBAL flag AT %MX0.0 : BOOL; END_VAR RESOURCE press ON PLC
  TASK quick (INTERVAL := T#1ms, PRIORITY := 1);
  TASK idle (INTERVAL := T#5ms, PRIORITY := 5);
  TASK rise (SINGLE := flag, PRIORITY := 0);
  PROGRAM one WITH quick : Fast;
  PROGRAM two WITH idle : Slow;
  PROGRAM three WITH rise : Edge;
END_RESOURCE END_CONFIGURATION
)";
  (void)sandbox.write("twice.toml", "[task.idle]\nwatchdog_policy = 'task'\n");
  const ProgramEnd built = build(kStopped);
  ASSERT_TRUE(built.success()) << built.output;
  start(so("twice"));
  put({.bits = 1});
  EXPECT_TRUE(eventually([&] { return outputs().twice == 7; }));
  EXPECT_TRUE(eventually([&] { return outputs().edges == 1; }));
}

struct OpenPlcImage {
  std::uint8_t bits = 0, unused[2047]{};
  std::int16_t words[2]{};
};

// A program as it is written for OpenPLC.
TEST_P(TextWithATaskFile, HasLocationsOfOpenPlc) {
  constexpr const char* kText = R"(
PROGRAM Main
  VAR button AT %IX0.0 : BOOL; level AT %IW0 : INT; END_VAR
  VAR lamp AT %QX0.0 : BOOL; idle AT %QX0.1 : BOOL; speed AT %QW0 : INT; seen AT %QW1 : INT; END_VAR
  lamp := button;
  idle := NOT button;
  speed := 800;
  seen := level;
END_PROGRAM
CONFIGURATION cell RESOURCE press ON PLC
  TASK fast (INTERVAL := T#2ms, PRIORITY := 1);
  PROGRAM one WITH fast : Main;
END_RESOURCE END_CONFIGURATION
)";
  const ProgramEnd shared = build(kText, "open");
  ASSERT_TRUE(shared.success()) << shared.output;
  EXPECT_THAT(shared.output,
              HasSubstr("open.st:3:32: note: %IW0 shares its bits with %IX0.0: a value at one "));
  EXPECT_THAT(shared.output, HasSubstr("open.st:4:53: note: %QW0 shares its bits with %QX0.0, %QX0.1: "));
  (void)sandbox.write("open.toml", "locations = 'separate'\n");
  const ProgramEnd built = build(kText, "open");
  ASSERT_TRUE(built.success()) << built.output;
  EXPECT_THAT(built.output, Not(HasSubstr("shares its bits")));
  EXPECT_THAT(
      built.output,
      HasSubstr("the outputs have %QX0.0 in bit 0 of byte 0, %QX0.1 in bit 1 of byte 0, %QW0 in bytes "
                "2048 to 2049, %QW1 in bytes 2050 to 2051"));
  image_bytes = 4096;
  start(so("open"));
  const auto has = [&](int bits, int seen) {
    const auto now = outputs<OpenPlcImage>();
    return now.bits == bits && now.words[0] == 800 && now.words[1] == seen;
  };
  EXPECT_TRUE(eventually([&] { return has(2, 0); }));
  put(OpenPlcImage{.bits = 1, .words = {-7}});
  EXPECT_TRUE(eventually([&] { return has(1, -7); }));
  put(OpenPlcImage{.bits = 0, .words = {512}});
  EXPECT_TRUE(eventually([&] { return has(2, 512); }));
}

// A program as it is written for Beremiz.
TEST_P(TextWithATaskFile, HasLocationsOfSeveralNumbers) {
  constexpr const char* kText = R"(
PROGRAM Main
  VAR raw AT %IW0.1.8192.0 : INT; twice AT %QW0.1.8193.0 : INT; END_VAR
  VAR_EXTERNAL go : BOOL; lamp : BOOL; END_VAR
  lamp := go;
  twice := 2 * raw;
END_PROGRAM
CONFIGURATION cell
  VAR_GLOBAL go AT %IX0.1.2 : BOOL; lamp AT %QX0.1.2 : BOOL; END_VAR
  RESOURCE press ON PLC
    TASK fast (INTERVAL := T#2ms, PRIORITY := 1);
    PROGRAM one WITH fast : Main;
  END_RESOURCE
END_CONFIGURATION
)";
  const ProgramEnd chosen = build(kText, "devices");
  ASSERT_TRUE(chosen.success()) << chosen.output;
  EXPECT_THAT(chosen.output,
              HasSubstr("devices.st:3:7: note: %IW0.1.8192.0 lies in bytes 2 to 3 of the inputs"));
  EXPECT_THAT(chosen.output, HasSubstr("has the line \"%QX0.1.2\" = \"%QX0.0\""));
  const auto works = [&] {
    put(ImageIn{.bits = 1, .raw = 21});
    EXPECT_TRUE(eventually([&] { return outputs().bits == 1 && outputs().twice == 42; }));
    put(ImageIn{.bits = 0, .raw = -3});
    EXPECT_TRUE(eventually([&] { return outputs().bits == 0 && outputs().twice == -6; }));
  };
  start(so("devices"));
  works();
  (void)sandbox.write("devices.toml",
                      "[location]\n\"%IW0.1.8192.0\" = \"%IW1\"\n\"%QW0.1.8193.0\" = '%QW1'\n"
                      "'%IX0.1.2' = '%IX0.0'\n'%QX0.1.2' = '%QX0.0'\n");
  const ProgramEnd given = build(kText, "devices");
  ASSERT_TRUE(given.success()) << given.output;
  EXPECT_THAT(given.output, Not(HasSubstr("lies in")));
  EXPECT_EQ(sut->ask(ControlVerb::change_application, so("devices")).code, ErrorCode::ok) << "same places";
  works();
}

TEST_P(TextWithATaskFile, IsRefusedOnlineIfALocationWouldMove) {
  constexpr const char* kText = R"(
PROGRAM Main
  VAR one AT %QW0.1 : INT; two AT %QW0.2 : INT; END_VAR
  one := 1;
  two := two + 1;
END_PROGRAM
CONFIGURATION cell RESOURCE press ON PLC
  TASK fast (INTERVAL := T#2ms, PRIORITY := 1);
  PROGRAM main_1 WITH fast : Main;
END_RESOURCE END_CONFIGURATION
)";
  ASSERT_TRUE(build(kText, "moved").success());
  start(so("moved"));
  std::string text = kText;
  text.replace(text.find("%QW0.1"), 6, "%QW0.3");
  ASSERT_TRUE(build(text, "other").success());
  const ControlReply refused = sut->ask(ControlVerb::change_application, so("other"));
  EXPECT_EQ(refused.code, ErrorCode::refused);
  EXPECT_THAT(refused.text, HasSubstr("'location-QW0.2': qwLayout is 1, of the one that runs it is 17"));
  (void)sandbox.write("other.toml", "[location]\n'%QW0.2' = '%QW1'\n'%QW0.3' = '%QW0'\n");
  ASSERT_TRUE(build(text, "other").success());
  const ControlReply kept = sut->ask(ControlVerb::change_application, so("other"));
  EXPECT_EQ(kept.code, ErrorCode::ok) << kept.text;
  EXPECT_THAT(kept.text, Not(HasSubstr("location"))) << "nothing of it is carried over";
}

// Two outputs would change places, and no area its size.
TEST_P(TextWithATaskFile, IsRefusedOnlineIfALineMovesALocationOfOneNumber) {
  constexpr const char* kText = R"(
PROGRAM Main
  VAR one AT %QW0 : INT; two AT %QW1 : INT; END_VAR
  one := 1;
  two := two + 1;
END_PROGRAM
CONFIGURATION cell RESOURCE press ON PLC
  TASK fast (INTERVAL := T#2ms, PRIORITY := 1);
  PROGRAM main_1 WITH fast : Main;
END_RESOURCE END_CONFIGURATION
)";
  ASSERT_TRUE(build(kText, "plain").success());
  start(so("plain"));
  (void)sandbox.write("crossed.toml", "[location]\n'%QW0' = '%QW1'\n'%QW1' = '%QW0'\n");
  ASSERT_TRUE(build(kText, "crossed").success());
  const ControlReply refused = sut->ask(ControlVerb::change_application, so("crossed"));
  EXPECT_EQ(refused.code, ErrorCode::refused) << refused.text;
  EXPECT_THAT(refused.text, HasSubstr("'location-QW0': qwLayout is 17, of the one that runs it is 1"));
}

}  // namespace
}  // namespace plchost::testing
