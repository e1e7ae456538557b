// The adapter for translated programs, and, where MATIEC or STruC++ is, the whole way from
// Structured Text.
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/adapters/run_program.hpp"
#include "tests/integration/instances/structured_text_fixture.hpp"

namespace plchost::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kTwice = R"(
PROGRAM Doubler
  VAR_EXTERNAL go : BOOL; flag : BOOL; END_VAR
  VAR
    raw AT %IW1 : INT;
    lamp AT %QX0.1 : BOOL;
    around AT %QB0 : BYTE;
    twice AT %QW1 : INT;
    copied AT %QB5 : BYTE;
    preset AT %QB7 : BYTE := 9;
  END_VAR
  VAR late : TON; END_VAR
  copied := around;
  twice := raw * 2;
  late(IN := go, PT := T#20ms);
  lamp := late.Q;
  flag := go;
END_PROGRAM
PROGRAM Counter
  VAR edges AT %QB4 : USINT; END_VAR
  edges := edges + 1;
END_PROGRAM
PROGRAM Loop
  VAR_EXTERNAL flag : BOOL; END_VAR
  VAR loops AT %QB6 : BYTE; END_VAR
  loops := BOOL_TO_BYTE(flag);
END_PROGRAM
CONFIGURATION cell
  VAR_GLOBAL go AT %IX0.0 : BOOL; flag AT %MX0.3 : BOOL; END_VAR
  RESOURCE press ON PLC
    TASK fast (INTERVAL := T#2ms, PRIORITY := 1);
    TASK edge (SINGLE := go, PRIORITY := 0);
    PROGRAM one WITH fast : Doubler;
    PROGRAM two WITH edge : Counter;
    PROGRAM rest : Loop;
  END_RESOURCE
END_CONFIGURATION
)";

constexpr const char* kCounting = R"(
PROGRAM Main
  VAR RETAIN total : DINT := 100; of_shift : ARRAY[0..2] OF INT; END_VAR
  VAR fresh : DINT; END_VAR
  VAR
    held AT %QX10.0 : BOOL;
    go AT %IX0.0 : BOOL;
    total_out AT %QD0 : DINT;
    fresh_out AT %QD1 : DINT;
    shift_out AT %QW4 : INT;
  END_VAR
  IF go THEN held := TRUE; END_IF;
  total := total + 1;
  fresh := fresh + 1;
  of_shift[1] := of_shift[1] + 1;
  total_out := total;
  fresh_out := fresh;
  shift_out := of_shift[1];
END_PROGRAM
CONFIGURATION cell
  RESOURCE press ON PLC
    TASK fast (INTERVAL := T#2ms, PRIORITY := 1);
    PROGRAM one WITH fast : Main;
  END_RESOURCE
END_CONFIGURATION
)";

// A task that others interrupt after it has written, and before it puts out.
constexpr const char* kInterrupted = R"(
PROGRAM Slow
  VAR_EXTERNAL flag : BOOL; lamp : BOOL; END_VAR
  VAR mine : BOOL; i : DINT; work : DINT; END_VAR
  VAR go AT %IX0.0 : BOOL; lost AT %QD1 : DINT; cycles AT %QD2 : DINT; END_VAR
  IF flag <> mine OR lamp <> mine THEN lost := lost + 1; END_IF;
  mine := NOT mine;
  flag := mine;
  lamp := mine;
  FOR i := 0 TO 500000 DO work := work + i; END_FOR;
  cycles := cycles + 1;
END_PROGRAM
PROGRAM Fast
  VAR_EXTERNAL flag : BOOL; lamp : BOOL; END_VAR
  VAR seen AT %QX0.1 : BOOL; cycles AT %QD3 : DINT; END_VAR
  seen := flag AND lamp;
  cycles := cycles + 1;
END_PROGRAM
CONFIGURATION cell
  VAR_GLOBAL flag AT %MX0.0 : BOOL; lamp AT %QX0.0 : BOOL; END_VAR
  RESOURCE press ON PLC
    TASK quick (INTERVAL := T#1ms, PRIORITY := 1);
    TASK idle (INTERVAL := T#5ms, PRIORITY := 5);
    PROGRAM one WITH quick : Fast;
    PROGRAM two WITH idle : Slow;
  END_RESOURCE
END_CONFIGURATION
)";

constexpr const char* kLoops = R"(
PROGRAM Main
  VAR one : DINT := 1; i : DINT; END_VAR
  VAR equal AT %QD0 : DINT; wide AT %QD1 : DINT; down AT %QD2 : DINT; none AT %QD3 : DINT; cycles AT %QD4 : DINT; END_VAR
  equal := 0; wide := 0; down := 0; none := 0;
  FOR i := 1 TO one DO equal := equal + 1; END_FOR;
  FOR i := 0 TO one BY 3 DO wide := wide + 1; END_FOR;
  FOR i := 5 TO one BY -2 DO down := down + 1; END_FOR;
  FOR i := 2 TO one DO none := none + 1; END_FOR;
  cycles := cycles + 1;
END_PROGRAM
CONFIGURATION cell
  RESOURCE press ON PLC
    TASK fast (INTERVAL := T#2ms, PRIORITY := 1);
    PROGRAM one WITH fast : Main;
  END_RESOURCE
END_CONFIGURATION
)";

struct Turns {
  std::int32_t equal = 0, wide = 0, down = 0, none = 0, cycles = 0;
};

struct Counted {
  std::int32_t total = 0, fresh = 0;
  std::int16_t of_shift = 0;
  std::uint8_t held = 0, unused = 0;
};

class TranslatedByMatiec : public StructuredText {
 protected:
  void SetUp() override {
    if (!has("PLCHOST_MATIEC")) GTEST_SKIP() << "needs MATIEC (PLCHOST_MATIEC)";
  }
};

class TranslatedByStrucpp : public StructuredText {
 protected:
  void SetUp() override {
    if (!has("PLCHOST_STRUCPP")) GTEST_SKIP() << "needs STruC++ (PLCHOST_STRUCPP)";
  }
};

INSTANTIATE_TEST_SUITE_P(By, TranslatedText, ::testing::Values("matiec", "strucpp"),
                         [](const auto& compiler) { return compiler.param; });

TEST_F(StructuredText, ByTheAdapterHasItsTasksAndItsLocatedVariables) {
  start(application("located"));
  expect_it_works();
}

TEST_F(StructuredText, ByTheAdapterHasExternalEventsAndTheOptionsOfItsTasks) {
  start(application("located"));
  PoolEvent product = sut->event("product");
  EXPECT_EQ(product.post(), PostResult::posted);
  EXPECT_EQ(product.post(), PostResult::posted);
  EXPECT_TRUE(eventually([&] { return outputs().posts == 2; })) << "plc_app_init has registered the event";
  EXPECT_TRUE(eventually([&] { return sut->task("guarded")->counters.cycles == 2; }));
  EXPECT_EQ(product.post(), PostResult::posted);
  EXPECT_TRUE(eventually([&] { return sut->task("guarded")->state == PageTaskState::exception; }))
      << "its watchdog and its policy";
  EXPECT_EQ(product.post(), PostResult::posted);
  EXPECT_TRUE(eventually([&] { return outputs().posts == 4; })) << "the other tasks run on";
}

TEST_P(TranslatedText, RunsAsItIsWritten) {
  const ProgramEnd built = build(kTwice);
  ASSERT_TRUE(built.success()) << built.output;
  EXPECT_THAT(built.output, HasSubstr("twice.so: built"));
  EXPECT_THAT(built.output, HasSubstr("PROGRAM rest has no TASK: it runs freewheeling"));
  for (const char* const scheduler : {"CmpSchedule", "CmpScheduleTimer", "CmpScheduleOneShot"}) {
    SCOPED_TRACE(scheduler);
    clear();
    ASSERT_NO_FATAL_FAILURE(start(so("twice"), "first", scheduler));
    EXPECT_EQ(sut->runtime().scheduler.view(), scheduler);
    expect_it_works();
  }
}

TEST_P(TranslatedText, LoopsAsOftenAsItsBoundsSay) {
  const ProgramEnd built = build(kLoops, "loops");
  ASSERT_TRUE(built.success()) << built.output;
  start(so("loops"));
  ASSERT_TRUE(eventually([&] { return outputs<Turns>().cycles > 5; }));
  const auto turns = outputs<Turns>();
  EXPECT_EQ(turns.equal, 1);
  EXPECT_EQ(turns.wide, 1);
  EXPECT_EQ(turns.down, 3);
  EXPECT_EQ(turns.none, 0);
}

TEST_P(TranslatedText, HasEachSignOfItsTexts) {
  const ProgramEnd end = build(R"(
PROGRAM Prg
  VAR_EXTERNAL note : STRING; END_VAR
  VAR twice AT %QW1 : INT; alarm : STRING := 'Alarm$0A1'; line : STRING; code : STRING; feed : STRING; ran : INT; END_VAR
  line := 'p$N5$41B$0D1';
  code := '(*';
  ran := 0;
  ran := ran + 32;
  line := CONCAT(line, '*)');
  feed := '$L1';
  twice := ran;
  IF alarm = 'Alarm$0A$31' THEN twice := twice + 1; END_IF;
  IF note = 'a$0A$62$31' THEN twice := twice + 2; END_IF;
  IF line = 'p$0A$35$41$42$0D$31$2A$29' THEN twice := twice + 4; END_IF;
  IF code = '$28$2A' THEN twice := twice + 8; END_IF;
  IF feed = '$0A$31' THEN twice := twice + 16; END_IF;
END_PROGRAM
CONFIGURATION c VAR_GLOBAL note : STRING := 'a$0Ab1'; END_VAR RESOURCE r ON PLC
TASK fast (INTERVAL := T#2ms, PRIORITY := 1); PROGRAM main WITH fast : Prg; END_RESOURCE END_CONFIGURATION)");
  ASSERT_TRUE(end.success()) << end.output;
  start(so("twice"));
  EXPECT_TRUE(eventually([&] { return outputs().twice == 63; })) << outputs().twice;
}

TEST_P(TranslatedText, ThatRetainsVariablesHasThemAfterARestart) {
  const ProgramEnd built = build(kCounting, "counting");
  ASSERT_TRUE(built.success()) << built.output;
  start(so("counting"));
  EXPECT_TRUE(eventually([&] { return outputs<Counted>().total > 120; }))
      << "it begins with its initial value";
  const auto before = outputs<Counted>();
  EXPECT_EQ(before.total, before.fresh + 100);
  sut->end(SIGKILL);
  start(so("counting"), "after-fault");
  // Until its first cycle the image is still that of the process before.
  Counted after;
  EXPECT_TRUE(eventually([&] {
    after = outputs<Counted>();
    return after.fresh > 5 && after.total >= before.total + after.fresh;
  })) << after.total;
  EXPECT_GE(after.of_shift, before.of_shift + after.fresh);
  // The kill may have come between the two.
  EXPECT_THAT(after.total - 100 - after.of_shift, ::testing::AnyOf(0, 1));
  sut->end(SIGKILL);
  start(so("counting"), "cold");
  EXPECT_TRUE(eventually([&] {
    const auto cold = outputs<Counted>();
    return cold.fresh > 5 && cold.total == cold.fresh + 100;
  }));
}

TEST_P(TranslatedText, ThatIsInterruptedLosesNothingThatItWrote) {
  const ProgramEnd built = build(kInterrupted, "interrupted");
  ASSERT_TRUE(built.success()) << built.output;
  EXPECT_THAT(built.output, HasSubstr("the tasks quick, idle use flag and can pre-empt each other"));
  start(so("interrupted"));
  EXPECT_TRUE(eventually([&] { return outputs<Interrupted>().slow > 300; }));
  EXPECT_EQ(outputs<Interrupted>().lost, 0);
  EXPECT_GT(outputs<Interrupted>().fast, 300);
}

TEST_P(TranslatedText, WithPersistentIsRefusedAtTheWord) {
  std::string text = kCounting;
  text.replace(text.find("VAR RETAIN"), 10, "VAR PERSISTENT");
  EXPECT_THAT(build(text, "kept").output, HasSubstr("kept.st:3:7: PERSISTENT: "));
}

TEST_P(TranslatedText, ThatIsChangedOnlineGoesOnWithItsValues) {
  ASSERT_TRUE(build(kCounting, "counting").success());
  std::string text = kCounting;
  text.replace(text.find("total + 1;"), 10, "total + 1000;");
  text.replace(text.find("VAR fresh"), 3, "VAR more : DINT := 7;");
  const ProgramEnd built = build(text, "faster");
  ASSERT_TRUE(built.success()) << built.output;
  start(so("counting"));
  put({.bits = 1});
  EXPECT_TRUE(eventually([&] { return outputs<Counted>().held == 1; }));
  put({.bits = 0});
  EXPECT_TRUE(eventually([&] { return outputs<Counted>().fresh > 20; }));
  const auto before = outputs<Counted>();
  const ControlReply reply = sut->ask(ControlVerb::change_application, so("faster"));
  EXPECT_EQ(reply.code, ErrorCode::ok) << reply.text;
  EXPECT_TRUE(eventually([&] { return outputs<Counted>().total > before.total + 5000; }));
  const auto after = outputs<Counted>();
  EXPECT_EQ(after.held, 1) << "an output keeps what the program had put there";
  EXPECT_GT(after.fresh, before.fresh);
  EXPECT_EQ(after.of_shift, after.fresh);
  text.replace(text.find("fresh : DINT"), 12, "fresh : REAL");
  text.replace(text.find("fresh + 1"), 9, "fresh + 1.0");
  text.replace(text.find(":= fresh;"), 9, ":= REAL_TO_DINT(fresh);");
  ASSERT_TRUE(build(text, "other").success());
  const ControlReply refused = sut->ask(ControlVerb::change_application, so("other"));
  EXPECT_EQ(refused.code, ErrorCode::refused);
  EXPECT_THAT(refused.text,
              HasSubstr("variable 'one.fresh': its type is REAL, of the one that runs it is DINT"));
}

TEST_P(TranslatedText, ThatRetainsOtherVariablesIsRefusedOnlineByTheirNames) {
  ASSERT_TRUE(build(kCounting, "counting").success());
  std::string text = kCounting;
  text.replace(text.find("VAR RETAIN"), 10, "VAR RETAIN more : DINT;");
  ASSERT_TRUE(build(text, "more").success());
  start(so("counting"));
  const ControlReply refused = sut->ask(ControlVerb::change_application, so("more"));
  EXPECT_EQ(refused.code, ErrorCode::refused);
  EXPECT_THAT(refused.text, HasSubstr("area 'retain': variable 'one.more' is new"));
  EXPECT_THAT(refused.text, ::testing::Not(HasSubstr("qwLayout")));
}

TEST_F(TranslatedByMatiec, ThatIsNamedAsAHeaderOfCIsBuilt) {
  std::string text = kCounting;
  text.replace(text.find("CONFIGURATION cell"), 18, "CONFIGURATION math");
  text.replace(text.find("RESOURCE press"), 14, "RESOURCE stdlib");
  const ProgramEnd built = build(text, "named");
  EXPECT_TRUE(built.success()) << built.output;
}

TEST_F(TranslatedByMatiec, OfSeveralResourcesBecomesAllApplicationsOrNone) {
  std::string text = kCounting;
  const std::size_t resource = text.find("  RESOURCE press");
  const std::string one = text.substr(resource, text.find("END_CONFIGURATION") - resource);
  std::string other = one;
  other.replace(other.find("press"), 5, "robot");
  text.insert(resource, other);
  ASSERT_TRUE(build(text, "two").success());
  const std::string press = sandbox.folder() + "/two-press.so";
  const std::string robot = sandbox.folder() + "/two-robot.so";
  ASSERT_TRUE(std::filesystem::exists(press) && std::filesystem::exists(robot));
  std::filesystem::remove(robot);
  std::filesystem::remove(press);
  std::filesystem::create_directory(robot);
  EXPECT_FALSE(build(text, "two").success());
  EXPECT_FALSE(std::filesystem::exists(press));
}

TEST_F(TranslatedByMatiec, ThatIsWrongIsToldInItsOwnWords) {
  std::string text = kTwice;
  text.replace(text.find("raw * 2"), 7, "row * 2");
  const ProgramEnd built = build(text);
  EXPECT_EQ(built.exit_code, 1);
  EXPECT_THAT(built.output, HasSubstr("twice.st:14:12: "));
  text = kTwice;
  text.replace(text.find(": Loop;"), 7, ": Loop (loops := 5);");
  EXPECT_THAT(build(text).output,
              HasSubstr("twice.st:35:5: PROGRAM rest: iec2c cannot translate connections"));
  text = kTwice;
  text.replace(text.find("PROGRAM Loop"), 12, "PROGRAM P");
  text.replace(text.find("late : TON;"), 11, "late : TON; f : Ahead;");
  text += "FUNCTION_BLOCK Ahead VAR n : INT; END_VAR n := 1; END_FUNCTION_BLOCK\n";
  EXPECT_THAT(build(text).output, HasSubstr("'P' is also a name in the library of iec2c"));
  text = std::string("FUNCTION_BLOCK Motor METHOD Go END_METHOD END_FUNCTION_BLOCK ") + kTwice;
  EXPECT_THAT(build(text).output, HasSubstr("twice.st:1:22: METHOD: MATIEC knows the second edition"));
  // iec2c ends at it without a place.
  text = std::string("TYPE Mode : (idle, busy); Rec : STRUCT m : Mode; n : INT; END_STRUCT; END_TYPE\n") +
         kTwice;
  text.replace(text.find("late : TON;"), 11, "late : TON; r : Rec := (n := 1, m := bussy);");
  EXPECT_THAT(build(text).output,
              HasSubstr("twice.st:13:44: 'bussy' is no value of MODE; it has IDLE, BUSY"));
}

TEST_F(TranslatedByMatiec, ThatHasCommentsWithinCommentsIsBuilt) {
  std::string text = kTwice;
  text.replace(text.find("copied := around;"), 0, "(* copied (* (* more *) *) and\n more *) ");
  const ProgramEnd built = build(text);
  EXPECT_EQ(built.exit_code, 0) << built.output;
}

TEST_F(TranslatedByStrucpp, ThatStrucppRefusesIsToldInItsOwnWords) {
  std::string text = kTwice;
  text.replace(text.find("raw * 2"), 7, "row * 2");
  const ProgramEnd built = build(text, "twice", "strucpp");
  EXPECT_EQ(built.exit_code, 1);
  EXPECT_THAT(built.output, HasSubstr("twice.st:14:12: "));
  text = kTwice;
  text.replace(text.find(": Loop;"), 7, ": Loop (loops := 5);");
  EXPECT_THAT(build(text, "twice", "strucpp").output,
              HasSubstr("twice.st:35:5: PROGRAM rest: STruC++ cannot translate connections"));
  text = kTwice;
  text.replace(text.find("    TASK fast"), 0, "    VAR_GLOBAL own : INT; END_VAR\n");
  text.replace(text.find("END_CONFIGURATION"), 0,
               "RESOURCE other ON PLC TASK t (INTERVAL := T#1s, PRIORITY := 1); END_RESOURCE\n");
  EXPECT_THAT(build(text, "twice", "strucpp").output,
              HasSubstr("own: STruC++ knows no VAR_GLOBAL in a RESOURCE"));
}

TEST_F(TranslatedByStrucpp, ArraysThatBeginWithZerosAreToldAndNoOthers) {
  const ProgramEnd end = build(R"(TYPE Row : STRUCT
  inRow : ARRAY [1..2] OF INT := [1, 2]; END_STRUCT; END_TYPE
VAR_GLOBAL outside : ARRAY [1..2] OF INT := [1, 2]; END_VAR
FUNCTION_BLOCK Fb
VAR_INPUT given : ARRAY [1..2] OF INT := [1, 2]; END_VAR
VAR own : ARRAY [1..2] OF INT := [1, 2]; r : Row; END_VAR
VAR_OUTPUT n : INT; END_VAR
METHOD Sum : INT VAR inMethod : ARRAY [1..2] OF INT := [1, 2]; END_VAR Sum := inMethod[1]; END_METHOD
n := own[1] + given[2] + outside[1] + Sum();
END_FUNCTION_BLOCK
PROGRAM Prg VAR b : Fb;
  inProgram, second : ARRAY [1..2] OF INT := [1, 2]; END_VAR
VAR_TEMP
  temporary : ARRAY [1..2] OF INT := [1, 2]; END_VAR
VAR_EXTERNAL inside : ARRAY [1..2] OF INT; END_VAR
  b(); inProgram[1] := temporary[1] + inside[1];
END_PROGRAM
CONFIGURATION k VAR_GLOBAL
  inside : ARRAY [1..2] OF INT := [1, 2]; END_VAR
RESOURCE r ON PLC TASK t (INTERVAL := T#2ms, PRIORITY := 1); PROGRAM m WITH t : Prg; END_RESOURCE END_CONFIGURATION)",
                               "arrays", "strucpp");
  ASSERT_TRUE(end.success()) << end.output;
  const std::string told = ": note: STruC++ drops the initial values of the array ";
  for (const char* const place : {"2:3", "12:3", "14:3", "19:3"}) {
    EXPECT_THAT(end.output, HasSubstr(fmt::format("arrays.st:{}{}", place, told)));
  }
  for (const char* const name : {"outside", "given", "own", "inMethod"}) {
    EXPECT_THAT(end.output, Not(HasSubstr(told + name)));
  }
}

TEST_F(TranslatedByStrucpp, ThatCountsDownIsToldOfTheEdge) {
  const ProgramEnd end = build(R"(
PROGRAM Prg VAR c : CTD; up : CTU;
  d : CTUD; END_VAR
  c(CD := TRUE, PV := 3);
END_PROGRAM
CONFIGURATION k RESOURCE r ON PLC TASK t (INTERVAL := T#2ms, PRIORITY := 1); PROGRAM m WITH t : Prg; END_RESOURCE END_CONFIGURATION)",
                               "counts", "strucpp");
  ASSERT_TRUE(end.success()) << end.output;
  EXPECT_THAT(end.output, HasSubstr("counts.st:2:17: note: c: STruC++ counts falling edges"));
  EXPECT_THAT(end.output, HasSubstr("counts.st:3:3: note: d: STruC++ counts falling edges"));
  EXPECT_THAT(end.output, Not(HasSubstr("up: STruC++")));
}

TEST_F(TranslatedByStrucpp, ThatReadsBeyondAnArrayStopsByAnException) {
  std::string text = kCounting;
  text.replace(text.find("of_shift[1] := "), 15, "of_shift[REAL_TO_INT(3.0)] := ");
  const ProgramEnd built = build(text, "beyond", "strucpp");
  ASSERT_TRUE(built.success()) << built.output;
  sut.emplace(sandbox, std::vector<std::string>{"--application", so("beyond")});
  EXPECT_TRUE(eventually([&] {
    const auto task = sut->task("fast");
    return task && task->state == PageTaskState::exception;
  })) << sut->log();
}

TEST_F(StructuredText, WithoutACompilerSaysHowToGetOne) {
  const ProgramEnd built = run_program({PLCCTL, "build", "application", sandbox.write("twice.st", kTwice),
                                        "-o", sandbox.folder() + "/twice.so", "--matiec", sandbox.folder()},
                                       sandbox.folder())
                               .value();
  EXPECT_EQ(built.exit_code, 1);
  EXPECT_THAT(built.output, HasSubstr("; build it there: autoreconf -i && ./configure && make"));
}

TEST_F(StructuredText, WhereNoCompilerIsFoundSaysHowToGetEach) {
  const ProgramEnd built =
      run_program({"/usr/bin/env", "-u", "PLCHOST_MATIEC", "-u", "PLCHOST_STRUCPP", "PATH=/", PLCCTL, "build",
                   "application", sandbox.write("twice.st", kTwice), "-o", so("twice")},
                  sandbox.folder())
          .value();
  EXPECT_EQ(built.exit_code, 1);
  EXPECT_THAT(built.output, HasSubstr("there is no compiler for Structured Text"));
  EXPECT_THAT(built.output, HasSubstr("name its folder by --matiec or PLCHOST_MATIEC"));
  EXPECT_THAT(built.output, HasSubstr("name its folder by --strucpp or PLCHOST_STRUCPP"));
  EXPECT_FALSE(std::filesystem::exists(so("twice")));
}

TEST_F(StructuredText, IsTranslatedByTheCompilerThatIsNamed) {
  const std::string source = sandbox.write("twice.st", kTwice);
  const auto said = [&](std::vector<std::string> options) {
    std::vector<std::string> command{PLCCTL, "build", "application", source, "-o", so("twice")};
    command.insert(command.end(), options.begin(), options.end());
    return run_program(command, sandbox.folder()).value();
  };
  EXPECT_THAT(said({"--compiler", "strucpp", "--strucpp", sandbox.folder()}).output,
              HasSubstr("there is no built STruC++"));
  EXPECT_THAT(said({"--compiler", "matiec", "--matiec", sandbox.folder()}).output,
              HasSubstr("there is no built MATIEC"));
  const auto unknown = said({"--compiler", "other"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.output, HasSubstr("--compiler: other not in {matiec,strucpp}"));
}

}  // namespace
}  // namespace plchost::testing
