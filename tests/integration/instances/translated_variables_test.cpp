// The variables of Structured Text that MATIEC or STruC++ has translated: seen, written and forced from
// outside, while a real plc-instance runs it.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

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

/// By the compiler of that name.
class VariablesOfTranslatedText : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    const char* const variable = GetParam() == "matiec" ? "PLCHOST_MATIEC" : "PLCHOST_STRUCPP";
    const char* const folder = std::getenv(variable);
    if (folder == nullptr || *folder == '\0') GTEST_SKIP() << "needs " << variable;
  }
  /// The messages of the build.
  std::string build(const std::string& text, const std::string& application) const {
    const auto built = run_program({PLCCTL, "build", "application", sandbox.write("shown.st", text), "-o",
                                    application, "--compiler", GetParam()},
                                   sandbox.folder());
    EXPECT_TRUE(built && built->success()) << (built ? built->output : built.error().describe());
    return built ? built->output : "";
  }
  void start(const std::string& text) {
    const std::string application = sandbox.folder() + "/shown.so";
    (void)build(text, application);
    ASSERT_FALSE(HasFailure());
    sut = std::make_unique<InstanceProcess>(sandbox, std::vector<std::string>{"--application", application});
    sut->wait_until_up();
  }

  Sandbox sandbox;
  std::unique_ptr<InstanceProcess> sut;
};

INSTANTIATE_TEST_SUITE_P(By, VariablesOfTranslatedText, ::testing::Values("matiec", "strucpp"),
                         [](const auto& compiler) { return compiler.param; });

constexpr const char* kShown = R"(
TYPE Point : STRUCT x : REAL; tags : ARRAY[1..3] OF INT; END_STRUCT; END_TYPE
FUNCTION_BLOCK Pump
  VAR_INPUT go : BOOL; END_VAR
  VAR hours : LREAL; END_VAR
  IF go THEN hours := hours + 1.0; END_IF;
END_FUNCTION_BLOCK
PROGRAM Main
  VAR_EXTERNAL total : DINT; END_VAR
  VAR
    rate : INT;
    twice : INT;
    pump1 : Pump;
    p : Point;
    grid : ARRAY[0..1, 1..2] OF INT;
    text1 : STRING := 'press';
    pause : TIME := T#1s500ms;
    day1 : DATE := D#2026-11-25;
  END_VAR
  VAR lamp AT %QX0.1 : BOOL; END_VAR
  VAR RETAIN cycles : DINT; pumps : Pump; steps : ARRAY[1..3] OF INT; END_VAR
  twice := rate * 2;
  total := total + 1;
  pump1(go := lamp);
  p.tags[2] := twice;
  grid[1,2] := rate;
END_PROGRAM
CONFIGURATION cell
  VAR_GLOBAL total : DINT; END_VAR
  RESOURCE press ON PLC
    TASK fast (INTERVAL := T#2ms, PRIORITY := 1);
    PROGRAM one WITH fast : Main;
  END_RESOURCE
END_CONFIGURATION
)";

TEST_P(VariablesOfTranslatedText, AreSeenWrittenAndForcedFromOutside) {
  start(kShown);
  ValueClient client(sandbox);
  const auto soon = [&](const std::string& name, const std::string& value) {
    return eventually([&] { return client.read(name) == value; });
  };
  const auto ask = [&](ControlVerb verb, const std::string& argument) { return sut->ask(verb, argument); };
  const auto write = [&](const std::string& argument) { return ask(ControlVerb::write_variable, argument); };
  const auto symbol = [&](const std::string& name) {
    return client.table().symbols()[client.table().find(name)->symbol];
  };
  EXPECT_EQ(type_text(symbol("one.grid[0,1]")), "ARRAY [0..1, 1..2] OF INT");
  EXPECT_EQ(symbol("one.rate").task, "fast");
  EXPECT_EQ(symbol("one.lamp").area, "%QX0.1");
  EXPECT_EQ(symbol("one.cycles").area, "retain");
  EXPECT_EQ(symbol("one.pumps.hours").area, "retain");
  EXPECT_EQ(symbol("one.steps[3]").area, "retain");
  EXPECT_EQ(symbol("one.rate").area, "");
  EXPECT_EQ(symbol("one").area, "program");
  EXPECT_EQ(symbol("one").task, "fast");
  EXPECT_EQ(client.read("one"), "'Main'");
  EXPECT_EQ(write("one.rate=21").code, ErrorCode::ok);
  EXPECT_TRUE(soon("one.twice", "42"));
  EXPECT_TRUE(soon("one.p.tags[2]", "42"));
  EXPECT_EQ(client.read("one.p.tags[1]"), "0");
  EXPECT_TRUE(soon("one.grid[1,2]", "21"));
  EXPECT_EQ(write("one.p.tags[3]=-3").code, ErrorCode::ok);
  EXPECT_EQ(client.read("one.p.tags[3]"), "-3");
  EXPECT_EQ(write("one.p.x=1.5").code, ErrorCode::ok);
  EXPECT_EQ(client.read("one.p.x"), "1.5");
  EXPECT_EQ(client.read("one.text1"), "'press'");
  EXPECT_EQ(write("one.text1='it$'s'").code, ErrorCode::ok);
  EXPECT_EQ(client.read("one.text1"), "'it$'s'");
  EXPECT_EQ(client.read("one.pause"), "T#1s500ms");
  EXPECT_EQ(write("one.pause=T#-2s").code, ErrorCode::ok);
  EXPECT_EQ(client.read("one.pause"), "T#-2s");
  EXPECT_EQ(client.read("one.day1"), "D#2026-11-25");
  EXPECT_EQ(write("one.day1=D#2027-01-31").code, ErrorCode::ok);
  EXPECT_EQ(client.read("one.day1"), "D#2027-01-31");
  EXPECT_EQ(ask(ControlVerb::force_variable, "one.rate=5").code, ErrorCode::ok);
  EXPECT_TRUE(soon("one.twice", "10"));
  EXPECT_EQ(ask(ControlVerb::force_variable, "total=100").code, ErrorCode::ok);
  EXPECT_TRUE(soon("total", "100"));
  EXPECT_EQ(client.read("one.pump1.hours"), "0.0");
  EXPECT_EQ(ask(ControlVerb::force_variable, "one.lamp=TRUE").code, ErrorCode::ok);
  EXPECT_TRUE(eventually([&] { return client.read("one.pump1.hours") != "0.0"; }));
  EXPECT_EQ(sut->runtime().forces, 3);
  EXPECT_EQ(ask(ControlVerb::unforce_variable, "*").code, ErrorCode::ok);
  EXPECT_TRUE(eventually([&] { return client.read("total") != "100"; }));
}

/// MATIEC knows no WSTRING.
class WideTexts : public VariablesOfTranslatedText {};
INSTANTIATE_TEST_SUITE_P(By, WideTexts, ::testing::Values("strucpp"),
                         [](const auto& compiler) { return compiler.param; });

TEST_P(WideTexts, AreSeenWrittenForcedAndRetained) {
  start(R"(
TYPE Part : STRUCT label : WSTRING(10); plain : STRING(10); END_STRUCT; END_TYPE
PROGRAM Main
  VAR_EXTERNAL shared : WSTRING; END_VAR
  VAR
    title : WSTRING := "press";
    copied : WSTRING(11);
    again : WSTRING(20);
    p : Part;
    huge : WSTRING(3000);
    names : ARRAY[1..2] OF WSTRING;
  END_VAR
  VAR RETAIN kept : WSTRING(4); END_VAR
  copied := title;
  again := copied;
  names[2] := title;
  p.label := shared;
  kept := "k";
END_PROGRAM
CONFIGURATION cell
  VAR_GLOBAL shared : WSTRING; END_VAR
  RESOURCE press ON PLC
    TASK fast (INTERVAL := T#2ms, PRIORITY := 1);
    PROGRAM one WITH fast : Main;
  END_RESOURCE
END_CONFIGURATION
)");
  ValueClient client(sandbox);
  const auto soon = [&](const std::string& name, const std::string& value) {
    return eventually([&] { return client.read(name) == value; });
  };
  const auto write = [&](const std::string& argument) {
    return sut->ask(ControlVerb::write_variable, argument);
  };
  const auto symbol = [&](const std::string& name) {
    return client.table().symbols()[client.table().find(name)->symbol];
  };
  EXPECT_EQ(type_text(symbol("one.title")), "WSTRING[254]");
  EXPECT_EQ(type_text(symbol("one.copied")), "WSTRING[11]");
  EXPECT_EQ(type_text(symbol("one.p.label")), "WSTRING[10]");
  EXPECT_EQ(type_text(symbol("one.names[1]")), "ARRAY [1..2] OF WSTRING[254]");
  EXPECT_EQ(type_text(symbol("shared")), "WSTRING[254]");
  EXPECT_EQ(symbol("one.kept").area, "retain");
  EXPECT_FALSE(client.table().find("one.huge"));
  EXPECT_THAT(sut->log(),
              HasSubstr("one.huge cannot be seen from outside: STruC++ keeps it as a text of more "
                        "than 4096 bytes"));
  EXPECT_EQ(client.read("one.title"), "\"press\"");
  EXPECT_EQ(write("one.title=\"gr\u00fc\u00df \U0001f600$D83D\"").code, ErrorCode::ok);
  EXPECT_TRUE(soon("one.copied", "\"gr\u00fc\u00df \U0001f600$D83D\""));
  EXPECT_TRUE(soon("one.names[2]", "\"gr\u00fc\u00df \U0001f600$D83D\""));
  EXPECT_EQ(client.read("one.names[1]"), "\"\"");
  EXPECT_EQ(write("one.kept=\u20ac1234").code, ErrorCode::invalid_argument);
  EXPECT_EQ(write("shared=\u20ac1234").code, ErrorCode::ok);
  EXPECT_TRUE(soon("one.p.label", "\"\u20ac1234\""));
  EXPECT_EQ(sut->ask(ControlVerb::force_variable, "one.copied=WSTRING#\"held\"").code, ErrorCode::ok);
  EXPECT_TRUE(soon("one.copied", "\"held\""));
  EXPECT_EQ(sut->ask(ControlVerb::force_variable, "one.title=\"forced\"").code, ErrorCode::ok);
  EXPECT_TRUE(soon("one.names[2]", "\"forced\""));
  EXPECT_EQ(client.read("one.copied"), "\"held\"");
  EXPECT_EQ(sut->ask(ControlVerb::unforce_variable, "*").code, ErrorCode::ok);
  EXPECT_TRUE(soon("one.again", "\"forced\""));
}

/// MATIEC knows no EXTENDS.
class VariablesOfAnHeir : public VariablesOfTranslatedText {};
INSTANTIATE_TEST_SUITE_P(By, VariablesOfAnHeir, ::testing::Values("strucpp"),
                         [](const auto& compiler) { return compiler.param; });

TEST_P(VariablesOfAnHeir, AreAlsoThoseOfTheBlocksThatItExtends) {
  start(R"(
FUNCTION_BLOCK Counter
  VAR_INPUT go : BOOL; END_VAR
  VAR t : ARRAY[1..2] OF INT; END_VAR
  IF go THEN t[2] := t[2] + 1; END_IF;
END_FUNCTION_BLOCK
FUNCTION_BLOCK Middle EXTENDS Counter
  VAR pause : TON; END_VAR
  pause(IN := go, PT := T#1h);
END_FUNCTION_BLOCK
FUNCTION_BLOCK Pump EXTENDS Middle
  VAR hours : LREAL; END_VAR
  IF go THEN hours := hours + 1.0; t[2] := 7; END_IF;
END_FUNCTION_BLOCK
PROGRAM Main
  VAR one : Pump; many : ARRAY[0..1] OF Pump; END_VAR
  one();
END_PROGRAM
CONFIGURATION cell
  RESOURCE press ON PLC
    TASK fast (INTERVAL := T#2ms, PRIORITY := 1);
    PROGRAM line WITH fast : Main;
  END_RESOURCE
END_CONFIGURATION
)");
  ValueClient client(sandbox);
  EXPECT_EQ(client.read("line.one.hours"), "0.0");
  EXPECT_EQ(sut->ask(ControlVerb::write_variable, "line.one.go=TRUE").code, ErrorCode::ok);
  EXPECT_TRUE(eventually([&] { return client.read("line.one.t[2]") == "7"; }));
  EXPECT_EQ(client.read("line.one.pause.PT"), "T#0s")
      << "the body of the block that is extended does not run";
  EXPECT_EQ(sut->ask(ControlVerb::write_variable, "line.many[1].t[1]=3").code, ErrorCode::ok);
  EXPECT_EQ(client.read("line.many[1].t[1]"), "3");
}

/// STruC++ knows no global function blocks.
class VariablesOfBlocks : public VariablesOfTranslatedText {};
INSTANTIATE_TEST_SUITE_P(By, VariablesOfBlocks, ::testing::Values("matiec"),
                         [](const auto& compiler) { return compiler.param; });

constexpr const char* kBlocks = R"(
FUNCTION_BLOCK Pump
  VAR turns : DINT; END_VAR
  turns := turns + 1;
END_FUNCTION_BLOCK
PROGRAM Main
  VAR_EXTERNAL count : CTU; pump1 : Pump; END_VAR
  VAR flank : BOOL; {attribute 'hide'} step1 : INT; END_VAR
  flank := NOT flank;
  count(CU := flank, PV := 30000);
  pump1();
END_PROGRAM
CONFIGURATION cell
  VAR_GLOBAL RETAIN count : CTU; END_VAR
  VAR_GLOBAL pump1 : Pump; END_VAR
  RESOURCE press ON PLC
    TASK fast (INTERVAL := T#2ms, PRIORITY := 1);
    PROGRAM one WITH fast : Main;
  END_RESOURCE
END_CONFIGURATION
)";

TEST_P(VariablesOfBlocks, ThatAreGlobalAreRetainedAndGoOnInAnOnlineChange) {
  std::string text = kBlocks;
  start(text);
  ValueClient client(sandbox);
  EXPECT_EQ(client.table().symbols()[client.table().find("count.CV")->symbol].area, "retain");
  EXPECT_EQ(client.table().symbols()[client.table().find("pump1.turns")->symbol].area, "");
  EXPECT_EQ(sut->ask(ControlVerb::write_variable, "count.CV=1000").code, ErrorCode::ok);
  EXPECT_EQ(sut->ask(ControlVerb::write_variable, "pump1.turns=1000000").code, ErrorCode::ok);
  text.replace(text.find("step1"), 5, "step1, step2");
  const std::string said = build(text, sandbox.folder() + "/next.so");
  const ControlReply reply = sut->ask(ControlVerb::change_application, sandbox.folder() + "/next.so");
  ASSERT_EQ(reply.code, ErrorCode::ok) << reply.text;
  EXPECT_TRUE(eventually([&] {
    client.open_table();
    return client.read("one.step2") == "0";
  }));
  EXPECT_GT(std::stoi(client.read("count.CV")), 999);
  EXPECT_GT(std::stoi(client.read("pump1.turns")), 999999);
  EXPECT_THAT(said, HasSubstr("{attribute 'hide'} has no effect"));
}

TEST_P(VariablesOfBlocks, OfTheLibraryAreAllKnown) {
  std::string variables;
  std::size_t count = 0;
  for (const auto& file : std::filesystem::directory_iterator(
           std::filesystem::path(std::getenv("PLCHOST_MATIEC")) / "lib")) {  // NOLINT(concurrency-mt-unsafe)
    std::ifstream lines(file.path());
    for (std::string word; file.is_regular_file() && lines >> word;) {
      if (word != "FUNCTION_BLOCK" || !(lines >> word)) continue;
      variables += fmt::format("block{} : {}; ", ++count, word);
    }
  }
  ASSERT_GT(count, 20U);
  std::string text = kBlocks;
  text.replace(text.find("flank :"), 0, variables);
  EXPECT_THAT(build(text, sandbox.folder() + "/all.so"), Not(HasSubstr("cannot be seen")));
}

}  // namespace
}  // namespace plchost::testing
