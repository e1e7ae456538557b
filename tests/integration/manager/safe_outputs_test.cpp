// The outputs of an instance that cannot put them into their safe state itself: the manager does.
#include <csignal>
#include <cstring>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/files/memory_file.hpp"
#include "shm/pages/outputs_page.hpp"
#include "shm/plc_process_image.h"
#include "shm/pool/object_pool.hpp"
#include "tests/integration/manager/plant.hpp"
#include "tests/support/safe_states.hpp"

namespace plchost {
namespace {

using plchost::testing::OutputWords;
using plchost::testing::SafeCase;
using ::testing::HasSubstr;

class SafeOutputsUnderAManager : public ::testing::TestWithParam<SafeCase> {
 protected:
  SafeOutputsUnderAManager() {
    plant.write_file("device", std::string(4096, '\0'));
    plant.write_file("line1.cfg", plchost::testing::settings_of(GetParam(), "device") +
                                      "[Task.Loop]\nWatchdog.TimeUs=20000\n");
    add_line1();
    plant.start_manager();
    EXPECT_TRUE(plant.wait_for("line1", InstanceState::running)) << plant.log();
    EXPECT_EQ(plc_image_open(plant.pool().c_str(), "io.out", 16, PLC_IMAGE_READ, &terminal), 0);
  }
  ~SafeOutputsUnderAManager() override { plc_image_close(&terminal); }

  void add_line1() { plant.add("line1", "outputs", "settings = \"line1.cfg\"\nrestart = \"never\""); }
  [[nodiscard]] bool shows(unsigned state, const OutputWords& words, std::uint64_t registers) const {
    OutputWords shown{};
    const bool read = plc_image_read(&terminal, shown.data(), nullptr) == PLC_IMAGE_OK;
    const std::string device = plant.text_of("device");
    std::uint64_t in_device = 0;
    std::memcpy(&in_device, device.data(), sizeof in_device);
    return read && plc_image_state(&terminal) == state && shown == words && in_device == registers;
  }
  void expect_driven() const {
    EXPECT_TRUE(Plant::eventually(
        [&] { return shows(PLC_IMAGE_STATE_RUNNING, GetParam().driven(), 0x5555555555555555); }));
  }
  [[nodiscard]] bool shows_safe(unsigned state) const {
    return shows(state, GetParam().shown, GetParam().registers);
  }
  void expect_safe(unsigned state) const {
    EXPECT_TRUE(Plant::eventually([&] { return shows_safe(state); })) << plant.log();
  }
  void expect_ended() const { expect_safe(PLC_IMAGE_STATE_ENDED); }
  void post(const std::string& event) const {
    auto pool = ObjectPool::attach(plant.pool());
    ASSERT_TRUE(pool);
    auto opened = pool->open_event(event);
    ASSERT_TRUE(opened);
    (void)opened->post();
  }
  [[nodiscard]] std::string page() const {
    return MemoryFile::path(outputs_page_name(plant.pool(), "line1"));
  }
  void kill_instance() {
    const auto process = open_process(plant.status("line1").pid);
    ASSERT_TRUE(process);
    ASSERT_TRUE(signal_process(*process, SIGKILL));
  }

  Plant plant;
  plc_image terminal{};
};

TEST_P(SafeOutputsUnderAManager, AreSafeWhenTheProcessIsKilledAndDrivenByTheNextOne) {
  expect_driven();
  kill_instance();
  expect_ended();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::failed));
  EXPECT_EQ(plant.ask(ControlVerb::start, "line1").code, ErrorCode::ok);
  expect_driven();
}

TEST_P(SafeOutputsUnderAManager, AreMadeSafeByTheNextManagerIfBothAreKilled) {
  expect_driven();
  plant.kill_manager();
  plant.kill_instances();
  EXPECT_TRUE(shows(PLC_IMAGE_STATE_RUNNING, GetParam().driven(), 0x5555555555555555)) << "nobody can tell";
  EXPECT_TRUE(Plant::eventually([&] { return plc_image_heartbeat_age_ns(&terminal) > 300'000'000; }))
      << "but by its age";
  plant.clear_instances();
  add_line1();
  plant.start_manager();
  expect_ended();
}

TEST_P(SafeOutputsUnderAManager, AreMadeSafeByAManagerWhoseConfigurationHasLostTheInstance) {
  expect_driven();
  plant.kill_manager();
  plant.kill_instances();
  plant.clear_instances();
  plant.start_manager();
  expect_ended();
  EXPECT_TRUE(Plant::eventually([&] { return !std::filesystem::exists(page()); })) << "it goes behind them";
}

TEST_P(SafeOutputsUnderAManager, StayDrivenWhileOnlyTheManagerIsKilled) {
  expect_driven();
  plant.kill_manager();
  plant.clear_instances();
  add_line1();
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running)) << plant.log();
  EXPECT_TRUE(plant.wait_for_cycles("line1"));
  EXPECT_TRUE(shows(PLC_IMAGE_STATE_RUNNING, GetParam().driven(), 0x5555555555555555));
  kill_instance();
  expect_ended();
}

TEST_P(SafeOutputsUnderAManager, FollowTheCommands) {
  expect_driven();
  EXPECT_EQ(plant.ask(ControlVerb::stop, "line1").code, ErrorCode::ok);
  EXPECT_TRUE(shows_safe(PLC_IMAGE_STATE_STOPPED));
  EXPECT_EQ(plant.ask(ControlVerb::start, "line1").code, ErrorCode::ok);
  expect_driven();
  EXPECT_EQ(plant.ask(ControlVerb::set_scheduler, "line1", "CmpScheduleTimer").code, ErrorCode::ok);
  EXPECT_TRUE(plant.wait_for_cycles("line1"));
  EXPECT_TRUE(shows(PLC_IMAGE_STATE_RUNNING, GetParam().driven(), 0x5555555555555555));
  EXPECT_EQ(plant.ask(ControlVerb::reset, "line1").code, ErrorCode::ok);
  EXPECT_TRUE(shows_safe(PLC_IMAGE_STATE_STOPPED)) << "of a fresh process, before its first cycle";
  EXPECT_EQ(plant.ask(ControlVerb::start, "line1").code, ErrorCode::ok);
  expect_driven();
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  EXPECT_TRUE(shows_safe(PLC_IMAGE_STATE_ENDED));
  EXPECT_FALSE(std::filesystem::exists(page()));
}

TEST_P(SafeOutputsUnderAManager, AreSafeAfterAWatchdogAndDrivenAfterAReset) {
  expect_driven();
  post("line1/loop");
  expect_safe(PLC_IMAGE_STATE_EXCEPTION);
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::exception));
  kill_instance();
  expect_ended();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::failed));
  EXPECT_EQ(plant.ask(ControlVerb::restart, "line1").code, ErrorCode::ok);
  expect_driven();
}

TEST_P(SafeOutputsUnderAManager, OfAProcessThatStandsStillAreToldByTheirAge) {
  expect_driven();
  const auto process = open_process(plant.status("line1").pid);
  ASSERT_TRUE(process);
  ASSERT_TRUE(signal_process(*process, SIGSTOP));
  EXPECT_TRUE(Plant::eventually([&] { return plc_image_silence_ns(&terminal) > 300'000'000; }));
  EXPECT_EQ(plc_image_state(&terminal), PLC_IMAGE_STATE_RUNNING) << "nobody can know whether it goes on";
  ASSERT_TRUE(signal_process(*process, SIGCONT));
  EXPECT_TRUE(Plant::eventually([&] { return plc_image_silence_ns(&terminal) < 100'000'000; }));
  expect_driven();
  ASSERT_TRUE(signal_process(*process, SIGSTOP));
  ASSERT_TRUE(signal_process(*process, SIGKILL));
  expect_ended();
}

// Devices that it names would be written with the rights of the manager.
TEST_P(SafeOutputsUnderAManager, AStrangersPageIsNotFollowed) {
  if (::geteuid() != 0) GTEST_SKIP() << "to give files to another user needs root";
  constexpr uid_t kStranger = 65534;
  expect_driven();
  ASSERT_EQ(::chown(page().c_str(), kStranger, kStranger), 0);
  kill_instance();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::failed));
  EXPECT_TRUE(shows(PLC_IMAGE_STATE_RUNNING, GetParam().driven(), 0x5555555555555555));
  EXPECT_THAT(plant.log(), HasSubstr("line1: its outputs stay as they are: "));
  EXPECT_THAT(plant.log(), HasSubstr("was put there by another program"));
  EXPECT_EQ(plant.ask(ControlVerb::start, "line1").code, ErrorCode::ok) << "it takes the place of that page";
  expect_driven();
  kill_instance();
  expect_ended();
}

INSTANTIATE_TEST_SUITE_P(AsSet, SafeOutputsUnderAManager, ::testing::ValuesIn(plchost::testing::kSafeCases),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace plchost
