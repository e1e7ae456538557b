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

// Two runs of registers, with 11 and 22 in the first of each.
std::string two_reads(const SerialLine& line, ModbusPeer& peer, int count) {
  std::string text = serial_device(line, 1, 0);
  text.resize(text.find("[[device.read]]"));
  text.replace(text.find("reconnect_max_ms = 2000"), 23, "reconnect_max_ms = 100");
  for (const int map : {0, 1}) {
    const int address = 100 + 10 * map;
    peer.with([&](modbus_mapping_t& mapping) {
      mapping.tab_input_registers[address] = static_cast<std::uint16_t>(11 + 11 * map);
    });
    text += fmt::format(
        "[[device.read]]\nkind = \"input_register\"\naddress = {}\ncount = {}\nimage = \"t.in\"\n"
        "offset = {}\n",
        address, count, 4 * map);
  }
  return text;
}

bool are_right(const Plant& plant) {
  return plant.input_word(0) == 11 && plant.input_word(4) == 22;
}

::testing::AssertionResult stays_lost(const Plant& plant, const ModbusPeer& peer, const ModbusProgram& sut) {
  const int requests = peer.requests();
  bool was_right = true;
  bool was_lost = true;
  const bool asked = eventually([&] {
    was_right = was_right && are_right(plant);
    was_lost = was_lost && !quality_is(plant, 40, Quality::good);
    return !was_right || !was_lost || peer.requests() > requests + 20;
  });
  if (was_right && was_lost && asked) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << plant.input_word(0) << ' ' << plant.input_word(4) << ", quality "
                                       << plant.status(40).quality << '\n'
                                       << sut.log();
}

struct Lateness {
  int requests;
  int count;  ///< of registers in each map
};
class ModbusLateDevice : public ::testing::TestWithParam<Lateness> {};

// RTU has no number of a request: only the kind of a response tells which one it belongs to.
TEST_P(ModbusLateDevice, IsLostUntilItAnswersInTime) {
  Plant plant;
  const SerialLine line;
  ModbusPeer peer(line, 1);
  const std::string config = plant.write(two_reads(line, peer, GetParam().count));
  {
    const ModbusProgram sut(plant, config);
    ASSERT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::good) && are_right(plant); }))
        << sut.log();
    peer.answer_late(GetParam().requests);
    ASSERT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::lost); })) << sut.log();
    EXPECT_TRUE(stays_lost(plant, peer, sut));
  }
  // The next process does not know which requests the device still answers.
  const ModbusProgram next(plant, config, "next.log");
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::lost); })) << next.log();
  EXPECT_TRUE(stays_lost(plant, peer, next));
  peer.set(ModbusPeer::Mode::normal);
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::good) && are_right(plant); }))
      << next.log();
}
INSTANTIATE_TEST_SUITE_P(Each, ModbusLateDevice,
                         ::testing::Values(Lateness{1, 2}, Lateness{2, 2}, Lateness{3, 2}, Lateness{4, 2},
                                           Lateness{1, 1}, Lateness{2, 1}, Lateness{3, 1}));

// Two processes at one line would take each other's responses.
// Others wait for their turn meanwhile.
TEST(ModbusLine, ADeviceThatRefusesAllIsAskedOnceInEachPoll) {
  constexpr std::chrono::milliseconds kPoll{20};
  Plant plant;
  const SerialLine line;
  ModbusPeer peer(line, 1);
  peer.set(ModbusPeer::Mode::refuses);
  const ModbusProgram sut(plant, plant.write(two_reads(line, peer, 2)));
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::exception); })) << sut.log();
  const TimePoint begin = MonotonicClock::now();
  const int before = peer.requests();
  ASSERT_TRUE(eventually([&] { return peer.requests() > before + 30; })) << sut.log();
  const int requests = peer.requests() - before;
  EXPECT_LE(requests, (MonotonicClock::now() - begin) / kPoll + 2);
}

TEST(ModbusLine, ALineHasOneProcess) {
  Plant plant;
  Plant other;
  const SerialLine line;
  ModbusPeer peer(line, 1);
  const std::string config = plant.write(serial_device(line, 1, 0));
  ModbusProgram first(plant, config);
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::good); })) << first.log();
  std::string text = serial_device(line, 2, 8);
  const std::string link = other.file("tty");
  text.replace(text.find(line.path()), line.path().size(), link);
  std::filesystem::create_symlink(line.path(), link);
  ModbusProgram second(other, other.write(text));
  EXPECT_EQ(second.end(), 1);
  EXPECT_TRUE(
      second.logged(fmt::format("{}: process {} (plchost-modbus --config {}) uses this line; end that "
                                "one, or put all devices of the line into one file",
                                link, first.pid(), config)))
      << second.log();
  EXPECT_EQ(first.end(SIGKILL), -SIGKILL);
  const ModbusProgram third(plant, config, "third.log");
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::good); })) << third.log();
}

TEST(ModbusLine, ALineThatComesLaterHasOneProcess) {
  Plant plant;
  Plant other;
  const SerialLine line;
  ModbusPeer peer(line, 1);
  const std::string link = other.file("tty");
  std::string text = serial_device(line, 1, 0);
  text.replace(text.find(line.path()), line.path().size(), link);
  const ModbusProgram second(other, other.write(text));
  ASSERT_TRUE(eventually([&] { return quality_is(other, 40, Quality::lost); })) << second.log();
  ModbusProgram first(plant, plant.write(serial_device(line, 1, 0)));
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::good); })) << first.log();
  std::filesystem::create_symlink(line.path(), link);
  const auto requests = peer.requests();
  ASSERT_TRUE(eventually([&] { return peer.requests() > requests + 100; }));
  EXPECT_TRUE(quality_is(other, 40, Quality::lost));
  EXPECT_EQ(first.end(SIGTERM), 0);
  EXPECT_TRUE(eventually([&] { return quality_is(other, 40, Quality::good); })) << second.log();
}

TEST(ModbusLine, TwoNamesOfOneLineInAFileAreRefused) {
  Plant plant;
  const SerialLine line;
  std::string text = serial_device(line, 2, 8);
  const std::string link = plant.file("tty");
  text.replace(text.find(line.path()), line.path().size(), link);
  std::filesystem::create_symlink(line.path(), link);
  ModbusProgram sut(plant, plant.write(serial_device(line, 1, 0) + text));
  EXPECT_EQ(sut.end(), 1);
  EXPECT_TRUE(sut.logged(link + ": another device of this file has this line by another path")) << sut.log();
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
