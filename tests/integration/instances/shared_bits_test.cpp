// Located variables of Structured Text that share bits, by MATIEC and STruC++: the terminal has what the
// statements of each cycle say, and what an operator forces or writes.
#include <cstdint>
#include <string>

#include "tests/integration/instances/structured_text_fixture.hpp"
#include "tests/integration/instances/value_client.hpp"

namespace plchost::testing {
namespace {

using ::testing::HasSubstr;

struct SharedWords {
  std::uint16_t assigned = 0, left = 0, flags = 0, unused = 0;
  std::int32_t lost = 0, sets = 0;
};

/// By the compiler of that name.
class TextWithSharedBits : public TranslatedText {
 protected:
  void build_and_start(const std::string& text) {
    const ProgramEnd built = build(text, "shared");
    ASSERT_TRUE(built.success()) << built.output;
    start(so("shared"));
  }
  // For a while, of which each cycle counts.
  void expect_in_each_cycle(std::uint16_t value) {
    ASSERT_TRUE(eventually([&] { return outputs<SharedWords>().assigned == value; }))
        << outputs<SharedWords>().assigned;
    const std::uint64_t first = cycles();
    while (cycles() < first + 200) ASSERT_EQ(outputs<SharedWords>().assigned, value);
  }
  std::uint64_t cycles() { return sut->task("fast")->counters.cycles; }
};

INSTANTIATE_TEST_SUITE_P(By, TextWithSharedBits, ::testing::Values("matiec", "strucpp"),
                         [](const auto& compiler) { return compiler.param; });

constexpr const char* kShared = R"(
PROGRAM Main
  VAR
    all AT %QW0 : WORD; pump AT %QX0.0 : BOOL; valve AT %QX0.1 : BOOL;
    whole AT %QW1 : WORD; bit AT %QX2.0 : BOOL;
    flags AT %QW2 : WORD; last AT %MX20.0 : BOOL;
    stop, lamp : BOOL;
    n : INT;
  END_VAR
  all := 16#0100;
  pump := TRUE;
  valve := n MOD 3 < 5;
  n := n + 1;
  IF lamp THEN bit := TRUE; END_IF;
  IF stop THEN whole := 0; END_IF;
END_PROGRAM
CONFIGURATION cell
  RESOURCE press ON PLC
    TASK fast (INTERVAL := T#1ms, PRIORITY := 1);
    PROGRAM one WITH fast : Main;
  END_RESOURCE
END_CONFIGURATION
)";

TEST_P(TextWithSharedBits, HasItsStatementsInOrderInEachCycle) {
  ASSERT_NO_FATAL_FAILURE(build_and_start(kShared));
  expect_in_each_cycle(0x0103);
}

TEST_P(TextWithSharedBits, HasAForcedBitInEachCycle) {
  ASSERT_NO_FATAL_FAILURE(build_and_start(kShared));
  ValueClient client(sandbox);
  EXPECT_EQ(sut->ask(ControlVerb::force_variable, "one.valve=FALSE").code, ErrorCode::ok);
  expect_in_each_cycle(0x0101);
  EXPECT_EQ(client.read("one.all"), "16#0101");
  EXPECT_EQ(sut->ask(ControlVerb::force_variable, "one.all=16#0200").code, ErrorCode::ok);
  expect_in_each_cycle(0x0200);
  EXPECT_EQ(client.read("one.pump"), "FALSE");
  EXPECT_EQ(sut->ask(ControlVerb::force_variable, "one.pump=TRUE").code, ErrorCode::ok);
  expect_in_each_cycle(0x0201);  // the narrow one
  EXPECT_EQ(sut->ask(ControlVerb::unforce_variable, "*").code, ErrorCode::ok);
  expect_in_each_cycle(0x0103);
}

TEST_P(TextWithSharedBits, KeepsWhatAnOperatorWrites) {
  ASSERT_NO_FATAL_FAILURE(build_and_start(kShared));
  ValueClient client(sandbox);
  const auto write = [&](const std::string& text) {
    EXPECT_EQ(sut->ask(ControlVerb::write_variable, text).code, ErrorCode::ok);
  };
  const auto soon = [&](std::uint16_t left, const std::string& bit) {
    return eventually([&] { return outputs<SharedWords>().left == left && client.read("one.bit") == bit; });
  };
  write("one.bit=TRUE");
  EXPECT_TRUE(soon(1, "TRUE"));
  EXPECT_EQ(client.read("one.whole"), "16#0001");
  write("one.whole=16#0200");
  EXPECT_TRUE(soon(0x0200, "FALSE"));
  write("one.lamp=TRUE");
  EXPECT_TRUE(soon(0x0201, "TRUE"));
  write("one.lamp=FALSE");
  write("one.stop=TRUE");
  EXPECT_TRUE(soon(0, "FALSE")) << "a bit that a statement has set before";
}

TEST_P(TextWithSharedBits, HasTheInitialValuesOfNewPlacesAfterAnOnlineChange) {
  ASSERT_NO_FATAL_FAILURE(build_and_start(kShared));
  std::string text = kShared;
  text.replace(text.find("n : INT;"), 8,
               "n : INT; fresh AT %MX10.0 : BOOL := TRUE; third AT %QX2.3 : BOOL := TRUE;");
  text.replace(text.find("n := n + 1;"), 11, "n := n + 1; IF fresh THEN flags := flags OR 16#0004; END_IF;");
  const ProgramEnd built = build(text, "next");
  ASSERT_TRUE(built.success()) << built.output;
  EXPECT_EQ(sut->ask(ControlVerb::write_variable, "one.whole=16#0100").code, ErrorCode::ok);
  EXPECT_TRUE(eventually([&] { return outputs<SharedWords>().left == 0x0100; }));
  const ControlReply reply = sut->ask(ControlVerb::change_application, so("next"));
  EXPECT_EQ(reply.code, ErrorCode::ok) << reply.text;
  EXPECT_TRUE(eventually([&] { return outputs<SharedWords>().left == 0x0108; }))
      << outputs<SharedWords>().left;
  EXPECT_TRUE(eventually([&] { return outputs<SharedWords>().flags == 4; }));
}

constexpr const char* kWordsAndBits = R"(
PROGRAM Toggles
  VAR_EXTERNAL words : WORD; END_VAR
  VAR i, m : DINT; END_VAR
  words := words XOR 16#0100;
  FOR i := 1 TO 200000 DO m := m * 3 + i; END_FOR;
END_PROGRAM
PROGRAM Bits
  VAR_EXTERNAL bit : BOOL; END_VAR
  VAR lost AT %QD2 : DINT; sets AT %QD3 : DINT; is_set : BOOL; k : INT; END_VAR
  IF is_set AND NOT bit THEN lost := lost + 1; END_IF;
  k := k + 1;
  IF k MOD 3 = 0 THEN
    is_set := NOT is_set;
    bit := is_set;
    sets := sets + 1;
  END_IF;
END_PROGRAM
CONFIGURATION cell
  VAR_GLOBAL words AT %MW0 : WORD; bit AT %MX0.0 : BOOL; END_VAR
  RESOURCE press ON PLC
    TASK fast (INTERVAL := T#1ms, PRIORITY := 1);
    TASK slow (INTERVAL := T#3ms, PRIORITY := 5);
    PROGRAM one WITH slow : Toggles;
    PROGRAM two WITH fast : Bits;
  END_RESOURCE
END_CONFIGURATION
)";

TEST_P(TextWithSharedBits, OfTwoTasksLosesNoBitInTheMemory) {
  const ProgramEnd built = build(kWordsAndBits, "shared");
  ASSERT_TRUE(built.success()) << built.output;
  EXPECT_THAT(built.output, HasSubstr("%MX0.0 and %MW0 share bits, and the tasks fast, slow use them: a task "
                                      "has what another one assigns there from its next cycle on"));
  start(so("shared"));
  EXPECT_TRUE(eventually([&] { return outputs<SharedWords>().sets > 500; }));
  EXPECT_EQ(outputs<SharedWords>().lost, 0);
}

constexpr const char* kOneAddress = R"(
PROGRAM A
  VAR input AT %IX0.0 : BOOL; copy AT %QX0.0 : BOOL; END_VAR
  VAR_EXTERNAL flag : BOOL; END_VAR
  copy := input;
  flag := input;
END_PROGRAM
PROGRAM B
  VAR there AT %IX0.0 : BOOL; copy AT %QX1.0 : BOOL; flag AT %MX0.0 : BOOL; of_flag AT %QX1.1 : BOOL; END_VAR
  copy := there;
  of_flag := flag;
END_PROGRAM
CONFIGURATION cell
  VAR_GLOBAL flag AT %MX0.0 : BOOL; END_VAR
  RESOURCE press ON PLC
    TASK fast (INTERVAL := T#1ms, PRIORITY := 1);
    TASK slow (INTERVAL := T#2ms, PRIORITY := 5);
    PROGRAM one WITH fast : A;
    PROGRAM two WITH fast : B;
  END_RESOURCE
END_CONFIGURATION
)";

TEST_P(TextWithSharedBits, MayDeclareOneAddressSeveralTimes) {
  std::string text = kOneAddress;
  for (const char* const task : {"fast", "slow"}) {
    text.replace(text.find("two WITH ") + 9, 4, task);
    clear();
    ASSERT_NO_FATAL_FAILURE(build_and_start(text));
    put({.bits = 1});
    EXPECT_TRUE(eventually([&] { return outputs<SharedWords>().assigned == 0x0301; })) << task;
    put({.bits = 0});
    EXPECT_TRUE(eventually([&] { return outputs<SharedWords>().assigned == 0; })) << task;
  }
}

TEST_P(TextWithSharedBits, MayDeclareOneAddressOfTwoTypesByStrucppOnly) {
  std::string text = kOneAddress;
  text.replace(text.find("there AT %IX0.0 : BOOL"), 22, "there AT %IX0.0 : SINT");
  EXPECT_THAT(build(text, "types").output, HasSubstr("SINT does not fit into %IX0.0"));
  text = kOneAddress;
  text.replace(text.find("input AT"), 8, "w AT %IW1 : WORD; input AT");
  text.replace(text.find("there AT"), 8, "w AT %IW1 : INT; there AT");
  const ProgramEnd built = build(text, "types");
  if (GetParam() == "strucpp") {
    EXPECT_TRUE(built.success()) << built.output;
  } else {
    EXPECT_THAT(built.output,
                HasSubstr("types.st:9:7: %IW1 is INT here and WORD elsewhere: give the variables "
                          "of one location one type"));
  }
}

}  // namespace
}  // namespace plchost::testing
