// plchost-modbus between images and real devices of libmodbus, which stall, vanish and answer garbage.

#include <chrono>
#include <csignal>
#include <memory>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/integration/modbus/modbus_peer.hpp"
#include "tests/integration/modbus/modbus_program.hpp"

namespace plchost::testing {
namespace {

using modbus::Quality;
using ::testing::HasSubstr;
using Mode = ModbusPeer::Mode;
using namespace std::chrono_literals;

bool quality_is(const Plant& plant, unsigned offset, Quality quality) {
  return plant.status(offset).quality == static_cast<std::uint16_t>(quality);
}

// A device with an input register at byte 0, an output register, and its status at byte 56.
std::string device(const HeldPort& port, std::string_view more = "") {
  return fmt::format(R"(
[[device]]
name = "valves"
tcp = "{}"
poll_ms = 10
timeout_ms = 200
reconnect_ms = 100
reconnect_max_ms = 200
gone_after_ms = 300
status_image = "t.in"
status_offset = 56
{}
[[device.read]]
kind = "input_register"
address = 100
image = "t.in"
[[device.write]]
kind = "holding_register"
address = 7
count = 2
image = "t.out"
)",
                     port.address(), more);
}

// The register that device() reads.
void measure(ModbusPeer& peer, std::uint16_t value) {
  peer.with([&](modbus_mapping_t& mapping) { mapping.tab_input_registers[100] = value; });
}

TEST(ModbusDevices, ExchangesAllKindsOfRegisters) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  peer.with([](modbus_mapping_t& mapping) {
    mapping.tab_bits[3] = 1;
    mapping.tab_input_bits[2] = 1;
    mapping.tab_registers[10] = 0x1122;
    mapping.tab_registers[11] = 0x3344;
    mapping.tab_input_registers[0] = 4711;
  });
  const std::string text = fmt::format(R"(
[[device]]
name = "all"
tcp = "{}"
poll_ms = 10
status_image = "t.in"
status_offset = 48
[[device.read]]
kind = "coil"
address = 0
count = 10
image = "t.in"
[[device.read]]
kind = "discrete_input"
address = 2
image = "t.in"
offset = 2
bit = 7
[[device.read]]
kind = "holding_register"
address = 10
count = 2
image = "t.in"
offset = 4
order = "abcd"
[[device.read]]
kind = "input_register"
address = 0
image = "t.in"
offset = 8
[[device.write]]
kind = "coil"
address = 20
count = 3
image = "t.out"
bit = 1
[[device.write]]
kind = "coil"
address = 30
image = "t.out"
[[device.write]]
kind = "holding_register"
address = 40
count = 2
image = "t.out"
[[device.write]]
kind = "holding_register"
address = 50
image = "t.out"
)",
                                       port.address());
  const ModbusProgram sut(plant, plant.write(text));
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 48, Quality::good); })) << sut.log();
  const auto inputs = plant.inputs();
  EXPECT_EQ(inputs[0], 0x08);
  EXPECT_EQ(inputs[2], 0x80);
  EXPECT_EQ(plant.input_word(4), 0x3344);  // the low word of 0x11223344
  EXPECT_EQ(plant.input_word(6), 0x1122);
  EXPECT_EQ(plant.input_word(8), 4711);
  EXPECT_TRUE(eventually([&] {
    plant.put_out(0, 0x0105);
    return peer.holding(40) == 0x0105 && peer.holding(50) == 0x0105;
  }));
  EXPECT_TRUE(eventually([&] {  // bits 1 to 3 of 0x05, and bit 0
    plant.put_out(0, 0x0105);
    return peer.coil(20) == 0 && peer.coil(21) == 1 && peer.coil(22) == 0 && peer.coil(30) == 1;
  }));
}

TEST(ModbusDevices, ASilentPlcsOutputsBecomeZero) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  const ModbusProgram sut(plant, plant.write(device(port, "silent_after_ms = 500")));
  ASSERT_TRUE(eventually([&] {
    plant.put_out(0, 99);
    return peer.holding(7) == 99;
  })) << sut.log();
  EXPECT_TRUE(eventually([&] { return peer.holding(7) == 0; }));  // nothing is put out any more
}

TEST(ModbusDevices, ASilentPlcsOutputsStayIfSo) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  ModbusProgram sut(plant, plant.write(device(port, "silent_after_ms = 200\nwhen_silent = \"keep\"")));
  ASSERT_TRUE(eventually([&] {
    plant.put_out(0, 99);
    return peer.holding(7) == 99;
  })) << sut.log();
  const int requests = peer.requests();
  ASSERT_TRUE(eventually([&] { return peer.requests() > requests + 100; }));  // of 10 ms and more
  EXPECT_EQ(peer.holding(7), 99);
  EXPECT_EQ(sut.end(SIGTERM), 0);
  EXPECT_EQ(peer.holding(7), 99);
}

TEST(ModbusDevices, ADeviceThatVanishesIsGoneAndComesBack) {
  Plant plant;
  const HeldPort port;
  auto peer = std::make_unique<ModbusPeer>(port);
  measure(*peer, 5);
  const ModbusProgram sut(plant, plant.write(device(port, "when_gone = \"zero\"")));
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::good) && plant.input_word(0) == 5; }))
      << sut.log();
  peer.reset();
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::lost) && plant.input_word(0) == 0; }));
  EXPECT_GE(plant.status(56).age_ms, 300);
  EXPECT_TRUE(eventually([&] { return sut.logged("device 'valves' is lost"); }));
  peer = std::make_unique<ModbusPeer>(port);
  measure(*peer, 6);
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::good) && plant.input_word(0) == 6; }));
  // What the new device has forgotten is written again, although it has not changed.
  EXPECT_TRUE(eventually([&] {
    plant.put_out(0, 77);
    return peer->holding(7) == 77;
  }));
}

TEST(ModbusDevices, InputsOfALostDeviceStayWithTheirAge) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  measure(peer, 5);
  const ModbusProgram sut(plant, plant.write(device(port)));
  ASSERT_TRUE(eventually([&] { return plant.input_word(0) == 5; })) << sut.log();
  peer.set(Mode::stalls);
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::lost); }));
  EXPECT_TRUE(eventually([&] { return plant.status(56).age_ms > 1000; }));
  EXPECT_EQ(plant.input_word(0), 5);
  peer.set(Mode::normal);
  EXPECT_TRUE(
      eventually([&] { return plant.status(56).age_ms < 1000 && quality_is(plant, 56, Quality::good); }));
}

TEST(ModbusDevices, GarbageIsALostDevice) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port, Mode::garbage);
  measure(peer, 5);
  const ModbusProgram sut(plant, plant.write(device(port)));
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::lost); })) << sut.log();
  const int requests = peer.requests();
  EXPECT_TRUE(eventually([&] { return peer.requests() > requests + 2; }));
  EXPECT_EQ(plant.input_word(0), 0);
  peer.set(Mode::normal);
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::good) && plant.input_word(0) == 5; }));
}

// A response that never ends is over with the response timeout, not with the last byte.
TEST(ModbusDevices, AResponseThatNeverEndsIsALostDevice) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port, Mode::dribbles);
  const ModbusProgram sut(plant, plant.write(device(port)));
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::lost); })) << sut.log();
  peer.set(Mode::normal);
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::good); }));
}

TEST(ModbusDevices, TheExceptionOfADeviceIsShown) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port, Mode::refuses);
  const ModbusProgram sut(plant, plant.write(device(port)));
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::exception); })) << sut.log();
  EXPECT_EQ(plant.status(56).exception, 2);
  EXPECT_TRUE(
      eventually([&] { return sut.logged("refuses a request with exception 2: Illegal data address"); }));
  peer.set(Mode::normal);
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::good); }));
  EXPECT_EQ(plant.status(56).exception, 0);
}

TEST(ModbusDevices, AStalledDeviceDelaysNoOther) {
  Plant plant;
  const HeldPort stalled_port;
  const HeldPort port;
  ModbusPeer stalled(stalled_port, Mode::stalls);
  ModbusPeer peer(port);
  const std::string other = fmt::format(R"(
[[device]]
name = "stalled"
tcp = "{}"
poll_ms = 10
timeout_ms = 10000
[[device.read]]
kind = "coil"
address = 0
image = "t.in"
offset = 40
)",
                                        stalled_port.address());
  const ModbusProgram sut(plant, plant.write(other + device(port)));
  ASSERT_TRUE(eventually([&] { return stalled.requests() == 1; })) << sut.log();
  for (std::uint16_t value = 1; value <= 50; ++value) {
    measure(peer, value);
    ASSERT_TRUE(eventually([&] { return plant.input_word(0) == value; }));
  }
  EXPECT_EQ(stalled.requests(), 1);  // all the time it has waited for its answer
}

TEST(ModbusDevices, TheEndPutsOutputsAndInputsIntoTheirSafeState) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  measure(peer, 5);
  ModbusProgram sut(plant, plant.write(device(port, "when_gone = \"zero\"")));
  ASSERT_TRUE(eventually([&] {
    plant.put_out(0, 99);
    return peer.holding(7) == 99 && plant.input_word(0) == 5;
  })) << sut.log();
  plant.put_out(0, 99);
  EXPECT_EQ(sut.end(SIGTERM), 0);
  EXPECT_EQ(peer.holding(7), 0);
  EXPECT_EQ(plant.input_word(0), 0);
  EXPECT_EQ(plant.status(56).quality, 0);
  EXPECT_EQ(plant.status(56).age_ms, modbus::kNeverRead);
}

// Its timeout alone is ten times as long as the end of the process takes.
TEST(ModbusDevices, TheEndWaitsForNoStalledDevice) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port, Mode::stalls);
  const std::string text = device(port);
  std::string slow = text;
  slow.replace(slow.find("timeout_ms = 200"), 16, "timeout_ms = 10000");
  ModbusProgram sut(plant, plant.write(slow));
  ASSERT_TRUE(eventually([&] { return peer.requests() == 1; })) << sut.log();
  const auto begin = MonotonicClock::now();
  EXPECT_EQ(sut.end(SIGTERM), 0);
  const auto took = MonotonicClock::now() - begin;
  RecordProperty("ms", static_cast<int>(took / 1ms));
  EXPECT_LT(took, 8s);  // else it has waited for the response
  EXPECT_EQ(peer.requests(), 1);
}

TEST(ModbusDevices, AnImageHasOneWriter) {
  Plant plant;
  const HeldPort port;
  const ModbusPeer peer(port);
  const ModbusProgram first(plant, plant.write(device(port)));
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::good); })) << first.log();
  ModbusProgram second(plant, plant.write(device(port)), "second.log");
  EXPECT_EQ(second.end(), 1);
  EXPECT_THAT(second.log(), HasSubstr("image 't.in' of pool"));
  EXPECT_THAT(second.log(), HasSubstr("another process writes it"));
}

TEST(ModbusDevices, AKilledProcessLeavesAnImageThatTheNextTakesOver) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  measure(peer, 5);
  const std::string config = plant.write(device(port));
  ModbusProgram first(plant, config);
  ASSERT_TRUE(eventually([&] { return plant.input_word(0) == 5; })) << first.log();
  EXPECT_EQ(first.end(SIGKILL), -SIGKILL);
  EXPECT_EQ(plant.input_word(0), 5);
  peer.set(Mode::stalls);
  const ModbusProgram second(plant, config, "second.log");
  EXPECT_TRUE(eventually([&] { return plant.status(56).quality != 1; })) << second.log();
  EXPECT_EQ(plant.status(56).age_ms, modbus::kNeverRead);
  EXPECT_EQ(plant.input_word(0), 5);
  peer.set(Mode::normal);
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::good); }));
}

TEST(ModbusDevices, AnImageWhoseFileIsRemovedIsMadeAnew) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  measure(peer, 5);
  const ModbusProgram sut(plant, plant.write(device(port)));
  ASSERT_TRUE(eventually([&] { return plant.input_word(0) == 5; })) << sut.log();
  const std::string path = fmt::format("/dev/shm/{}.memory.t.in", plant.pool());
  ASSERT_EQ(::unlink(path.c_str()), 0);
  measure(peer, 6);
  plc_image anew{};
  ASSERT_TRUE(eventually([&] { return ::access(path.c_str(), F_OK) == 0; }));
  ASSERT_TRUE(eventually([&] {
    return plc_image_open(plant.pool().c_str(), "t.in", Plant::kSize, PLC_IMAGE_READ, &anew) == 0;
  }));
  std::array<std::uint16_t, Plant::kSize / 2> words{};
  EXPECT_TRUE(eventually(
      [&] { return plc_image_read(&anew, words.data(), nullptr) == PLC_IMAGE_OK && words[0] == 6; }));
  plc_image_close(&anew);
}

TEST(ModbusDevices, ABadConfigurationIsRefusedWithItsLine) {
  Plant plant;
  const std::string file = plant.write("[[device]]\nname = \"d\"\ntcp = \"somewhere\"\n");
  ModbusProgram sut(plant, file);
  EXPECT_EQ(sut.end(), 1);
  EXPECT_THAT(sut.log(), HasSubstr(file + ":13:1: [[device]] 'd' tcp: \"somewhere\" is no address"));
}

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

TEST(ModbusDevices, ExchangesWithADeviceAtASerialLine) {
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
  EXPECT_EQ(peer.holding(1), 0);
}

// A device that does not answer costs the others of its line one timeout for each of its attempts.
TEST(ModbusDevices, ADeviceThatIsNotAtTheLineLeavesItToTheOthers) {
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

TEST(ModbusDevices, ALineThatIsNotThereIsTriedAgain) {
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
