// The examples in ST and a project of PLCopen XML, from their sources to the process image.
#include <array>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/adapters/run_program.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/plc_process_image.h"
#include "tests/integration/instances/instance_process.hpp"

namespace plchost::testing {
namespace {

using ::testing::HasSubstr;

constexpr std::size_t kImage = 16;  // of the examples' settings
using Image = std::array<std::uint8_t, kImage>;

constexpr const char* kProject = R"(<?xml version="1.0" encoding="utf-8"?>
<project xmlns="http://www.plcopen.org/xml/tc6_0201" xmlns:xhtml="http://www.w3.org/1999/xhtml">
  <fileHeader companyName="a" productName="b" productVersion="1" creationDateTime="2026-01-31T12:00:00"/>
  <contentHeader name="c"><coordinateInfo/></contentHeader>
  <types>
    <dataTypes>
      <dataType name="T_Step"><baseType><INT/></baseType><initialValue><simpleValue value="3"/></initialValue></dataType>
      <dataType name="T_Sum"><baseType><struct>
        <variable name="total"><type><INT/></type></variable>
        <variable name="steps"><type><array><dimension lower="0" upper="1"/><baseType><INT/></baseType></array></type></variable>
      </struct></baseType></dataType>
    </dataTypes>
    <pous>
      <pou name="Main" pouType="program">
        <interface>
          <externalVars><variable name="raw"><type><INT/></type></variable></externalVars>
          <localVars>
            <variable name="sum"><type><derived name="T_Sum"/></type></variable>
            <variable name="factor"><type><derived name="T_Step"/></type></variable>
            <variable name="text"><type><string/></type><initialValue><simpleValue value="three"/></initialValue></variable>
            <variable name="out" address="%QW1"><type><INT/></type></variable>
          </localVars>
        </interface>
        <body>
          <ST>
            <xhtml:p><![CDATA[sum.steps[1] := raw * factor;
IF LEN(text) = 5 THEN
  sum.total := sum.steps[1] + 1;
END_IF;
out := sum.total;]]></xhtml:p>
          </ST>
        </body>
      </pou>
    </pous>
  </types>
  <instances>
    <configurations>
      <configuration name="cell">
        <resource name="press">
          <task name="fast" priority="1" interval="PT0.002S"><pouInstance name="one" typeName="Main"/></task>
        </resource>
        <globalVars><variable name="raw" address="%IW0"><type><INT/></type></variable></globalVars>
      </configuration>
    </configurations>
  </instances>
</project>
)";

/// Built by each compiler.
class StructuredTextExample : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    const char* const variable = GetParam() == "matiec" ? "PLCHOST_MATIEC" : "PLCHOST_STRUCPP";
    const char* const folder = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe)
    if (folder == nullptr || *folder == '\0') GTEST_SKIP() << "needs " << GetParam();
  }
  ~StructuredTextExample() override {
    plc_image_close(&inputs_);
    plc_image_close(&outputs_);
    sut.reset();
    remove_pool_memories(sandbox.pool());
  }

  [[nodiscard]] ProgramEnd build(const std::string& source) const {
    return run_program({PLCCTL, "build", "application", source, "-o", sandbox.folder() + "/it.so",
                        "--compiler", GetParam()},
                       sandbox.folder())
        .value();
  }
  /// STruC++ knows no initial value of a type: its variable has it.
  [[nodiscard]] static std::string project() {
    std::string text = kProject;
    if (GetParam() == "matiec") return text;
    const std::string value = "<initialValue><simpleValue value=\"3\"/></initialValue>";
    text.erase(text.find(value), value.size());
    const std::string type = "<type><derived name=\"T_Step\"/></type>";
    text.insert(text.find(type) + type.size(), value);
    return text;
  }
  /// Builds it and runs it with its settings, whose images are those of `terminal`.
  void start(const std::string& name, const std::string& terminal) {
    const std::string file = std::string(EXAMPLES) + "/" + name + "/" + name;
    const ProgramEnd built = build(file + ".st");
    ASSERT_TRUE(built.success()) << built.output;
    run(file + ".cfg", terminal);
  }
  void run(const std::string& settings, const std::string& terminal) {
    run_again(settings);
    const char* const pool = sandbox.pool().c_str();
    ASSERT_EQ(plc_image_open(pool, (terminal + ".in").c_str(), kImage, PLC_IMAGE_WRITE, &inputs_), 0);
    ASSERT_EQ(plc_image_open(pool, (terminal + ".out").c_str(), kImage, PLC_IMAGE_READ, &outputs_), 0);
  }
  /// Another process, with the same images.
  void run_again(const std::string& settings) {
    sut.emplace(sandbox,
                std::vector<std::string>{"--settings", settings, "--application", sandbox.folder() + "/it.so",
                                         "--state-directory", sandbox.folder() + "/state"});
    sut->wait_until_up();
  }
  void put(std::uint8_t bits, std::uint16_t word = 0, std::size_t at = 2) {
    put_in_ = {};
    put_in_[kQuality] = quality;
    put_in_[0] = bits;
    if (at != 0) std::memcpy(&put_in_.at(at), &word, sizeof word);
    if (at == 0) std::memcpy(put_in_.data(), &word, sizeof word);
    plc_image_write(&inputs_, put_in_.data());
  }
  /// A sign of the firmware, as plchost-modbus gives it to the packing line.
  void beat() {
    ++put_in_[11];
    plc_image_write(&inputs_, put_in_.data());
  }
  Image outputs() {
    Image image{};
    EXPECT_EQ(plc_image_read(&outputs_, image.data(), nullptr), PLC_IMAGE_OK);
    return image;
  }
  int word(std::size_t number) {
    std::int16_t value = 0;
    std::memcpy(&value, &outputs().at(2 * number), sizeof value);
    return value;
  }

  Sandbox sandbox;
  std::optional<InstanceProcess> sut;
  std::uint8_t quality = 0;  ///< of the terminal of the packing line, in the next put()

 private:
  static constexpr std::size_t kQuality = 8;
  plc_image inputs_{};
  plc_image outputs_{};
  Image put_in_{};
};

TEST_P(StructuredTextExample, TheTrafficLightLetsPeopleWalkWhenTheyAsk) {
  ASSERT_NO_FATAL_FAILURE(start("traffic_light", "lights"));
  constexpr int kRed = 1, kGreen = 4, kWalk = 8, kWait = 16;
  EXPECT_TRUE(eventually([&] { return outputs()[0] == kGreen; }));
  put(1);
  EXPECT_TRUE(eventually([&] { return outputs()[0] == (kGreen | kWait); }));
  put(0);
  EXPECT_TRUE(eventually([&] { return outputs()[0] == (kRed | kWalk); }));
  EXPECT_TRUE(eventually([&] { return outputs()[0] == kGreen && word(1) == 1; }));
}

TEST_P(StructuredTextExample, TheTemperatureLoopReachesItsSetPoint) {
  ASSERT_NO_FATAL_FAILURE(start("temperature", "vessel"));
  put(0, 300, 0);
  EXPECT_TRUE(eventually([&] { return word(1) > 0; })) << "the heater";
  EXPECT_TRUE(eventually([&] { return (outputs()[4] & 1) != 0; })) << "the set point is reached";
  EXPECT_GT(word(0), 290);
  EXPECT_LT(word(0), 310);
}

TEST_P(StructuredTextExample, ThePackingLineCountsEachProductAndHalts) {
  ASSERT_NO_FATAL_FAILURE(start("packing", "packing"));
  constexpr std::uint8_t kStop = 1, kEnable = 2, kAcknowledge = 4;
  constexpr int kMotor = 1, kFault = 2, kCartonFull = 4;
  quality = 1;
  put(kEnable, 300);
  EXPECT_TRUE(eventually([&] {
    beat();
    return (outputs()[0] & kMotor) != 0 && word(1) == 300;
  }));
  const PoolEvent product = sut->event("product");
  for (int i = 0; i < 25; ++i) EXPECT_EQ(product.post(), PostResult::posted);
  EXPECT_TRUE(eventually([&] { return word(2) == 25 && word(3) == 2; }));
  put(kEnable | kStop, 300);
  EXPECT_TRUE(eventually([&] { return (outputs()[0] & (kMotor | kFault)) == kFault && word(4) == 1; }));
  EXPECT_EQ(product.post(), PostResult::posted);
  EXPECT_TRUE(eventually([&] { return word(5) == 1; })) << "refused";
  // The button is held while the connection breaks, and no edge.
  const auto put_until_seen = [&](std::uint8_t bits) {
    put(bits, 300);
    for (int i = 0; i < 2; ++i) {  // the cycle that shows the first one may have had its inputs before
      const int refused = word(5);
      EXPECT_EQ(product.post(), PostResult::posted);
      EXPECT_TRUE(eventually([&] { return word(5) == refused + 1; }));
    }
  };
  put_until_seen(kEnable | kStop | kAcknowledge);
  quality = 2;
  put_until_seen(0);
  quality = 1;
  put_until_seen(kEnable | kAcknowledge);
  EXPECT_EQ(outputs()[0] & kFault, kFault) << "it is not acknowledged";
  put_until_seen(kEnable);
  put(kEnable | kAcknowledge, 300);
  const auto turns = [&] { return (outputs()[0] & (kMotor | kFault)) == kMotor; };
  const auto turns_with_signs = [&] {
    beat();
    return turns();
  };
  EXPECT_TRUE(eventually(turns_with_signs));
  EXPECT_EQ(word(2), 25);
  EXPECT_TRUE(eventually([&] { return !turns(); })) << "the firmware gives no sign any more";
  EXPECT_TRUE(eventually(turns_with_signs));

  EXPECT_EQ(sut->end(SIGTERM), 0);
  run_again(std::string(EXAMPLES) + "/packing/packing.cfg");
  EXPECT_EQ(sut->event("product").post(), PostResult::posted);
  bool was_full = false;
  EXPECT_TRUE(eventually([&] {
    was_full = was_full || (outputs()[0] & kCartonFull) != 0;
    return word(2) == 26 && word(3) == 2;
  }));
  EXPECT_FALSE(was_full || (outputs()[0] & kCartonFull) != 0) << "retained products are no new ones";
}

TEST_P(StructuredTextExample, AProjectOfPlcopenRunsAsItIsWritten) {
  const ProgramEnd built = build(sandbox.write("project.xml", project()));
  ASSERT_TRUE(built.success()) << built.output;
  ASSERT_NO_FATAL_FAILURE(run(std::string(EXAMPLES) + "/packing/packing.cfg", "packing"));
  put(0, 7, 0);
  EXPECT_TRUE(eventually([&] { return word(1) == 22; }));
}

TEST_P(StructuredTextExample, AProjectOfPlcopenThatIsWrongIsToldByItsPouAndLine) {
  std::string text = project();
  text.replace(text.find("raw * factor"), 12, "row * factor");
  EXPECT_THAT(build(sandbox.write("project.xml", text)).output,
              HasSubstr("project.xml:26: Main, line 1 of its body, column "));
  text = project();
  text.replace(text.find("END_IF;"), 7, "");
  EXPECT_THAT(build(sandbox.write("project.xml", text)).output,
              HasSubstr("Main, line 5 of its body, column "));
}

INSTANTIATE_TEST_SUITE_P(By, StructuredTextExample, ::testing::Values("matiec", "strucpp"),
                         [](const auto& compiler) { return compiler.param; });

}  // namespace
}  // namespace plchost::testing
