// Devices at a serial line, which a pair of terminals of the kernel is here.

#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <unistd.h>

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

TEST(ModbusLine, TheEndWaitsForNoSilentDevice) {
  Plant plant;
  const SerialLine line;
  std::string text = serial_device(line, 1, 0);
  text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 10000");
  ModbusProgram sut(plant, plant.write(text));
  pollfd asked{.fd = line.other_end(), .events = POLLIN, .revents = 0};
  ASSERT_EQ(::poll(&asked, 1, 40'000), 1) << sut.log();
  EXPECT_EQ(sut.end(SIGTERM), 0);
  EXPECT_FALSE(sut.logged("a device keeps its thread")) << sut.log();
  EXPECT_EQ(plant.status(40).quality, 0);
}

// The silent one has the line most of the time.
TEST(ModbusLine, TheEndReachesADeviceBesideASilentOne) {
  Plant plant;
  const SerialLine line;
  ModbusPeer peer(line, 1);
  std::string silent = serial_device(line, 2, 8);
  silent.replace(silent.find("timeout_ms = 200"), 16, "timeout_ms = 3000");
  ModbusProgram sut(plant, plant.write(serial_device(line, 1, 0) + silent));
  ASSERT_TRUE(eventually([&] {
    plant.put_out(0, 815);
    return peer.holding(1) == 815 && quality_is(plant, 48, Quality::lost);
  })) << sut.log();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // it is asked again
  EXPECT_EQ(sut.end(SIGTERM), 0);
  EXPECT_TRUE(eventually([&] { return peer.holding(1) == 0; })) << sut.log();
  EXPECT_FALSE(sut.logged("a device keeps its thread"));
}

// Devices of a line take turns, which may take longer together than those on TCP have.
TEST(ModbusLine, TheEndReachesAllOutputsOfALine) {
  constexpr int kMaps = 30;  // of ModbusPeer::kSlow and more each: far less than one answer may take
  Plant plant;
  const SerialLine line;
  ModbusPeer peer(line, 1);
  std::string text = serial_device(line, 1, 0);
  text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 2000\nsilent_after_ms = 60000");
  for (int i = 0; i < kMaps; ++i) {
    text += fmt::format("[[device.write]]\nkind = \"holding_register\"\naddress = {}\nimage = \"t.out\"\n",
                        200 + i);
  }
  ModbusProgram sut(plant, plant.write(text));
  ASSERT_TRUE(eventually([&] {
    plant.put_out(0, 815);
    return peer.holding(200 + kMaps - 1) == 815;
  })) << sut.log();
  peer.set(ModbusPeer::Mode::slow);
  EXPECT_EQ(sut.end(SIGTERM), 0);
  EXPECT_TRUE(eventually([&] { return peer.holding(200 + kMaps - 1) == 0; })) << sut.log();
  EXPECT_FALSE(sut.logged("a device keeps its thread"));
}

// The bytes up to a pause: a request.
std::vector<std::uint8_t> next_request(const SerialLine& line) {
  std::vector<std::uint8_t> request;
  pollfd look{.fd = line.other_end(), .events = POLLIN, .revents = 0};
  while (::poll(&look, 1, request.empty() ? 40'000 : 20) > 0) {
    std::uint8_t byte = 0;
    if (::read(line.other_end(), &byte, 1) == 1) request.push_back(byte);
  }
  return request;
}

// While a silent device has the line.
TEST(ModbusLine, OutputsDoNotGrowOldWhileADeviceWaitsForItsTurn) {
  Plant plant;
  const SerialLine line;
  std::string text = serial_device(line, 1, 0);
  text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 200\nsilent_after_ms = 600000");
  std::string silent = serial_device(line, 2, 8);
  silent.replace(silent.find("timeout_ms = 200"), 16, "timeout_ms = 3000");
  plant.put_out(0, 0x0815);
  const ModbusProgram sut(plant, plant.write(text + silent));
  std::vector<std::uint8_t> request;
  while ((request = next_request(line)).size() > 1 && request[0] != 2) {
  }
  ASSERT_GT(request.size(), 1U) << sut.log();
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // the other one wants to write meanwhile
  plant.put_out(0, 0x0042);
  while ((request = next_request(line)).size() > 1 && request[0] != 1) {
  }
  ASSERT_GT(request.size(), 8U) << sut.log();
  EXPECT_EQ(request[7] << 8U | request[8], 0x0042);
}

// RTU has no number of a request: only the kind of a response tells which one it belongs to.
TEST(ModbusLine, ADeviceThatAnswersOneRequestTooLateIsLost) {
  Plant plant;
  const SerialLine line;
  ModbusPeer peer(line, 1);
  peer.with([&](modbus_mapping_t& mapping) {
    mapping.tab_input_registers[100] = 11;
    mapping.tab_input_registers[110] = 22;
  });
  std::string text = serial_device(line, 1, 0);
  text.resize(text.find("[[device.read]]"));
  // A peer that stands still for that time is late by two.
  text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 2000");
  text.replace(text.find("reconnect_max_ms = 2000"), 23, "reconnect_max_ms = 500");
  for (const int map : {0, 1}) {
    text += fmt::format(
        "[[device.read]]\nkind = \"input_register\"\naddress = {}\ncount = 2\nimage = \"t.in\"\noffset = "
        "{}\n",
        100 + 10 * map, 4 * map);
  }
  const ModbusProgram sut(plant, plant.write(text));
  const auto are_right = [&] { return plant.input_word(0) == 11 && plant.input_word(4) == 22; };
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::good) && are_right(); })) << sut.log();
  peer.set(ModbusPeer::Mode::late);
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::lost); })) << sut.log();
  const int requests = peer.requests();
  ASSERT_TRUE(eventually([&] {
    EXPECT_TRUE(are_right()) << plant.input_word(0) << ' ' << plant.input_word(4);
    return HasFailure() || peer.requests() > requests + 10;
  })) << sut.log();
  peer.set(ModbusPeer::Mode::normal);
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::good) && are_right(); })) << sut.log();
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
