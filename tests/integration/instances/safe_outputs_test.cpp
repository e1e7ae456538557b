// The outputs of real instances, as a terminal sees them: after a stop, faults, watchdogs, kills.
#include <csignal>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/launch/launch_contract.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pages/outputs_page.hpp"
#include "shm/plc_process_image.h"
#include "tests/integration/instances/instance_process.hpp"
#include "tests/support/safe_states.hpp"

namespace plchost::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class SafeOutputsOf : public ::testing::TestWithParam<SafeCase> {
 protected:
  ~SafeOutputsOf() override {
    plc_image_close(&terminal);
    sut.reset();
    remove_pool_memories(sandbox.pool());
  }

  void start(const std::string& more_settings = {}, std::vector<std::string> more = {}) {
    const bool stopped = !more.empty();
    more.insert(more.end(),
                {"--settings", sandbox.write("line1.cfg", settings_of(GetParam(), device) + more_settings),
                 "--application", application("outputs")});
    sut.emplace(sandbox, more);
    sut->wait_until_up(!stopped);
    if (terminal.header != nullptr) return;
    ASSERT_EQ(plc_image_open(sandbox.pool().c_str(), "io.out", 16, PLC_IMAGE_READ, &terminal), 0);
  }
  [[nodiscard]] OutputWords shown() const {
    OutputWords words{};
    EXPECT_EQ(plc_image_read(&terminal, words.data(), nullptr), PLC_IMAGE_OK);
    return words;
  }
  [[nodiscard]] std::uint64_t in_device() const {
    std::ifstream stream(device, std::ios::binary);
    std::uint64_t word = 0;
    stream.read(reinterpret_cast<char*>(&word), sizeof word);
    return word;
  }
  void expect_driven() const { expect_driven(GetParam().driven()); }
  void expect_driven(const OutputWords& words) const {
    EXPECT_TRUE(eventually([&] {
      return plc_image_state(&terminal) == PLC_IMAGE_STATE_RUNNING && shown() == words &&
             in_device() == 0x5555555555555555;
    }));
  }
  void expect_safe(unsigned state) const {
    EXPECT_EQ(plc_image_state(&terminal), state);
    EXPECT_EQ(shown(), GetParam().shown);
    EXPECT_EQ(in_device(), GetParam().registers);
  }
  // Of a fault nobody waits for an answer.
  void expect_soon_safe(unsigned state) const {
    EXPECT_TRUE(eventually([&] {
      return plc_image_state(&terminal) == state && shown() == GetParam().shown &&
             in_device() == GetParam().registers;
    })) << sut->log();
  }

  Sandbox sandbox;
  std::string device = sandbox.write("device", std::string(4096, '\0'));
  std::optional<InstanceProcess> sut;
  plc_image terminal{};
};

TEST_P(SafeOutputsOf, AStoppedApplicationAreSafeUntilItsNextFirstCycle) {
  start();
  expect_driven();
  EXPECT_LT(plc_image_heartbeat_age_ns(&terminal), PLC_IMAGE_NEVER);
  ASSERT_EQ(sut->ask(ControlVerb::stop).code, ErrorCode::ok);
  expect_safe(PLC_IMAGE_STATE_STOPPED);
  ASSERT_EQ(sut->ask(ControlVerb::start).code, ErrorCode::ok);
  expect_driven();
  ASSERT_EQ(sut->ask(ControlVerb::stop).code, ErrorCode::ok);
  ASSERT_EQ(sut->ask(ControlVerb::single_cycle).code, ErrorCode::ok);
  expect_safe(PLC_IMAGE_STATE_STOPPED);
  EXPECT_EQ(sut->end(SIGTERM), 0);
  expect_safe(PLC_IMAGE_STATE_ENDED);
  EXPECT_FALSE(
      MemoryFile::open(outputs_page_name(sandbox.pool(), "line1"), 1, MemoryFile::Access::read_only));
}

TEST_P(SafeOutputsOf, AnApplicationAreSafeAfterAFault) {
  start();
  expect_driven();
  (void)sut->event("valve").post();
  (void)sut->event("valve").post();
  ASSERT_TRUE(eventually([&] { return plc_image_state(&terminal) == PLC_IMAGE_STATE_EXCEPTION; }));
  OutputWords expected = GetParam().shown;
  // The first post was a whole cycle.
  if (expected == kDriven) expected[2] = 0x33333333;
  EXPECT_TRUE(eventually([&] { return shown() == expected && in_device() == GetParam().registers; }));
  EXPECT_EQ(sut->end(SIGKILL), -SIGKILL);
  EXPECT_EQ(shown(), expected);
  EXPECT_EQ(plc_image_state(&terminal), PLC_IMAGE_STATE_EXCEPTION) << "there is no manager";
  end_outputs(sandbox.pool(), "line1");
  EXPECT_EQ(plc_image_state(&terminal), PLC_IMAGE_STATE_ENDED) << "as a manager does";
  EXPECT_EQ(shown(), expected);
}

TEST_P(SafeOutputsOf, AnApplicationAreSafeAfterAHitOfAWatchdog) {
  start("[Task.Loop]\nWatchdog.TimeUs=20000\n");
  expect_driven();
  (void)sut->event("loop").post();
  expect_soon_safe(PLC_IMAGE_STATE_EXCEPTION);
}

TEST_P(SafeOutputsOf, AProcessThatCrashesOutsideOfItsTasksAreSafeWithoutAManager) {
  start();
  expect_driven();
  (void)sut->event("crash").post();
  EXPECT_EQ(sut->end(), -SIGSEGV);
  expect_safe(PLC_IMAGE_STATE_EXCEPTION);
}

TEST_P(SafeOutputsOf, AnApplicationDoNotHearOfAProcessThatItHasForked) {
  start();
  expect_driven();
  (void)sut->event("fork").post();
  ASSERT_TRUE(eventually([&] { return sut->log().find("forked: ") != std::string::npos; }));
  EXPECT_THAT(sut->log(), HasSubstr("forked: signal 11"));
  const auto cycles = sut->task("Fast")->counters.cycles;
  ASSERT_TRUE(eventually([&] { return sut->task("Fast")->counters.cycles > cycles + 20; }));
  expect_driven();
  EXPECT_EQ(sut->task("Fork")->state, PageTaskState::running);
}

TEST_P(SafeOutputsOf, AKilledProcessAreMadeSafeByTheNextOneAlsoIfItHasNone) {
  start();
  expect_driven();
  sut->end(SIGKILL);
  sut.emplace(sandbox, std::vector<std::string>{"--application", application("bottling_line")});
  sut->wait_until_up();
  expect_safe(PLC_IMAGE_STATE_ENDED);
}

TEST_P(SafeOutputsOf, AnApplicationAreDrivenUnderEachScheduler) {
  start();
  expect_driven();
  for (const char* scheduler : {"CmpScheduleTimer", "CmpSchedule"}) {
    ASSERT_EQ(sut->ask(ControlVerb::set_scheduler, scheduler).code, ErrorCode::ok);
    const auto cycles = sut->task("Slow")->counters.cycles;
    ASSERT_TRUE(eventually([&] { return sut->task("Slow")->counters.cycles > cycles + 2; }));
    EXPECT_EQ(plc_image_state(&terminal), PLC_IMAGE_STATE_RUNNING);
    EXPECT_EQ(shown(), GetParam().driven());
  }
}

TEST_P(SafeOutputsOf, ATaskThatFailsAloneAreSafeAndOthersAreDriven) {
  start("[Task.Valve]\nWatchdog.Policy=Task\n");
  expect_driven();
  (void)sut->event("valve").post();
  OutputWords expected = GetParam().driven();
  expected[2] = 0x33333333;
  expect_driven(expected);
  (void)sut->event("valve").post();
  ASSERT_TRUE(eventually([&] { return sut->task("Valve")->state == PageTaskState::exception; }));
  if (GetParam().shown != kDriven) expected[2] = GetParam().shown[2];
  expect_driven(expected);
  const auto cycles = sut->task("Fast")->counters.cycles;
  ASSERT_TRUE(eventually([&] { return sut->task("Fast")->counters.cycles > cycles + 20; }));
  expect_driven(expected);
}

TEST_P(SafeOutputsOf, AKilledProcessAreToldByTheirAgesAndSafeInTheNextOne) {
  start();
  expect_driven();
  sut->end(SIGKILL);
  EXPECT_EQ(plc_image_state(&terminal), PLC_IMAGE_STATE_RUNNING);
  EXPECT_EQ(shown(), GetParam().driven());
  EXPECT_TRUE(eventually([&] {
    return plc_image_age_ns(&terminal) > 500'000'000 && plc_image_heartbeat_age_ns(&terminal) > 500'000'000;
  }));
  start({}, {"--stopped"});
  expect_safe(PLC_IMAGE_STATE_STOPPED);
  EXPECT_TRUE(eventually([&] { return plc_image_heartbeat_age_ns(&terminal) < 500'000'000; }));
  ASSERT_EQ(sut->ask(ControlVerb::start).code, ErrorCode::ok);
  expect_driven();
}

struct WrongSafeState {
  const char* setting;
  const char* text;
};

class WrongSafeStates : public ::testing::TestWithParam<WrongSafeState> {};

TEST_P(WrongSafeStates, AreRefusedWithPlaceAndWhatIsAllowed) {
  const Sandbox sandbox;
  const std::string settings = sandbox.write(
      "line1.cfg", settings_of({.name = "", .setting = GetParam().setting, .shown = {}, .registers = 0}));
  InstanceProcess sut(sandbox, {"--settings", settings, "--application", application("outputs")});
  EXPECT_EQ(sut.end(), kExitSetupFailed);
  EXPECT_THAT(sut.log(), AllOf(HasSubstr("line1.cfg:"), HasSubstr(GetParam().text)));
}

INSTANTIATE_TEST_SUITE_P(All, WrongSafeStates,
                         ::testing::Values(WrongSafeState{"Off",
                                                          "Keep, Zero, or 0x and two hexadecimal digits"},
                                           WrongSafeState{"", "Keep, Zero, or 0x and two hexadecimal digits"},
                                           WrongSafeState{"0x11", "SafeState gives 1 bytes, Size is 16"}));

INSTANTIATE_TEST_SUITE_P(AsSet, SafeOutputsOf, ::testing::ValuesIn(kSafeCases),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace plchost::testing
