// The outputs of an instance that cannot put them into their safe state itself: the manager does.
#include <csignal>
#include <cstring>
#include <fstream>
#include <string>

#include <gmock/gmock.h>

#include "shm/plc_process_image.h"
#include "tests/integration/manager/plant.hpp"
#include "tests/support/safe_states.hpp"

namespace plchost {
namespace {

using plchost::testing::kDriven;
using plchost::testing::OutputWords;
using plchost::testing::SafeCase;

class SafeOutputsUnderAManager : public ::testing::TestWithParam<SafeCase> {
 protected:
  SafeOutputsUnderAManager() {
    plant.write_file("device", std::string(4096, '\0'));
    plant.write_file("line1.cfg", plchost::testing::settings_of(GetParam(), "device"));
    plant.add("line1", "outputs", "settings = \"line1.cfg\"\nrestart = \"never\"");
    plant.start_manager();
    EXPECT_TRUE(plant.wait_for("line1", InstanceState::running)) << plant.log();
    EXPECT_EQ(plc_image_open(plant.pool().c_str(), "io.out", 16, PLC_IMAGE_READ, &terminal), 0);
  }
  ~SafeOutputsUnderAManager() override { plc_image_close(&terminal); }

  [[nodiscard]] bool shows(unsigned state, const OutputWords& words, std::uint64_t registers) const {
    OutputWords shown{};
    const bool read = plc_image_read(&terminal, shown.data(), nullptr) == PLC_IMAGE_OK;
    const std::string device = plant.lines_of("device").at(0);
    std::uint64_t in_device = 0;
    std::memcpy(&in_device, device.data(), sizeof in_device);
    return read && plc_image_state(&terminal) == state && shown == words && in_device == registers;
  }
  void expect_driven() const {
    EXPECT_TRUE(
        Plant::eventually([&] { return shows(PLC_IMAGE_STATE_RUNNING, kDriven, 0x5555555555555555); }));
  }
  void expect_ended() const {
    EXPECT_TRUE(Plant::eventually([&] {
      return shows(PLC_IMAGE_STATE_ENDED, GetParam().shown, GetParam().registers);
    })) << plant.log();
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
  EXPECT_TRUE(shows(PLC_IMAGE_STATE_RUNNING, kDriven, 0x5555555555555555)) << "nobody can tell";
  EXPECT_TRUE(Plant::eventually([&] { return plc_image_heartbeat_age_ns(&terminal) > 300'000'000; }))
      << "but by its age";
  plant.clear_instances();
  plant.add("line1", "outputs", "settings = \"line1.cfg\"\nrestart = \"never\"");
  plant.start_manager();
  expect_ended();
}

INSTANTIATE_TEST_SUITE_P(AsSet, SafeOutputsUnderAManager, ::testing::ValuesIn(plchost::testing::kSafeCases),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace plchost
