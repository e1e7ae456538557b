// Devices at a serial line, which a pair of terminals of the kernel is here.

#include <csignal>
#include <filesystem>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <poll.h>

#include "tests/integration/modbus/device_of_a_test.hpp"
#include "tests/integration/modbus/modbus_peer.hpp"
#include "tests/integration/modbus/modbus_program.hpp"

namespace plchost::testing {
namespace {

using modbus::Quality;

std::string serial_device(const SerialLine& line, int unit, int offset) {
  return fmt::format(R"(
[[device]]
name = "unit{1}"
serial = "{0}"
parity = "none"
unit = {1}
poll_ms = 20
timeout_ms = 200
reconnect_ms = 100
reconnect_max_ms = 2000
status_image = "t.in"
status_offset = {3}
[[device.read]]
kind = "input_register"
address = 100
image = "t.in"
offset = {2}
[[device.write]]
kind = "holding_register"
address = {1}
count = 2
image = "t.out"
)",
                     line.path(), unit, offset, 40 + offset);
}

TEST(ModbusLine, ExchangesWithADeviceAtASerialLine) {
  Plant plant;
  const SerialLine line;
  ModbusPeer peer(line, 1);
  measure(peer, 4711);
  ModbusProgram sut(plant, plant.write(serial_device(line, 1, 0)));
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::good) && plant.input_word(0) == 4711; }))
      << sut.log();
  EXPECT_TRUE(eventually([&] {
    plant.put_out(0, 815);
    return peer.holding(1) == 815;
  }));
  EXPECT_EQ(sut.end(SIGTERM), 0);
  EXPECT_TRUE(eventually([&] { return peer.holding(1) == 0; })) << "a moment after the end";
}

// A device that does not answer costs the others of its line one timeout for each of its attempts.
TEST(ModbusLine, ADeviceThatIsNotAtTheLineLeavesItToTheOthers) {
  Plant plant;
  const SerialLine line;
  ModbusPeer peer(line, 1);
  const ModbusProgram sut(plant, plant.write(serial_device(line, 1, 0) + serial_device(line, 2, 8)));
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 48, Quality::lost); })) << sut.log();
  for (std::uint16_t value = 1; value <= 10; ++value) {
    measure(peer, value);
    ASSERT_TRUE(eventually([&] { return plant.input_word(0) == value; }));
  }
}

// A wait at a serial line cannot be interrupted: the process ends without that thread.
TEST(ModbusLine, TheEndWaitsForNoSilentDevice) {
  Plant plant;
  const SerialLine line;
  std::string text = serial_device(line, 1, 0);
  text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 10000");
  ModbusProgram sut(plant, plant.write(text));
  pollfd asked{.fd = line.other_end(), .events = POLLIN, .revents = 0};
  ASSERT_EQ(::poll(&asked, 1, 40'000), 1) << sut.log();
  EXPECT_EQ(sut.end(SIGTERM), 0);
  EXPECT_FALSE(sut.logged("timed out")) << sut.log();
  EXPECT_TRUE(sut.logged("a device keeps its thread"));
  EXPECT_EQ(plant.status(40).quality, 0);
}

TEST(ModbusLine, ALineThatIsNotThereIsTriedAgain) {
  Plant plant;
  const SerialLine line;
  ModbusPeer peer(line, 1);
  std::string text = serial_device(line, 1, 0);
  const std::string link = plant.file("tty");
  text.replace(text.find(line.path()), line.path().size(), link);
  const ModbusProgram sut(plant, plant.write(text));
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::lost); })) << sut.log();
  std::filesystem::create_symlink(line.path(), link);
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::good); })) << sut.log();
}

}  // namespace
}  // namespace plchost::testing
