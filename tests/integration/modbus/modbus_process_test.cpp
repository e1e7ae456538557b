// The process: its end, its images and its file.

#include <array>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include "shm/files/pool_files.hpp"
#include "tests/integration/modbus/device_of_a_test.hpp"
#include "tests/integration/modbus/modbus_peer.hpp"
#include "tests/integration/modbus/modbus_program.hpp"

namespace plchost::testing {
namespace {

using modbus::Quality;
using ::testing::HasSubstr;
using Mode = ModbusPeer::Mode;
using namespace std::chrono_literals;

// The device may take the last request a moment after the process has ended.
bool becomes_zero(ModbusPeer& peer, int address) {
  return eventually([&] { return peer.holding(address) == 0; });
}

TEST(ModbusProcess, TheEndPutsOutputsAndInputsIntoTheirSafeState) {
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
  EXPECT_TRUE(becomes_zero(peer, 7));
  EXPECT_EQ(plant.input_word(0), 0);
  EXPECT_EQ(plant.status(56).quality, 0);
  EXPECT_EQ(plant.status(56).age_ms, modbus::kNeverRead);
}

TEST(ModbusProcess, TheEndSetsTheOutputsThatADeviceTakesThoughItRefusesOthers) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  std::string text = device(port);
  constexpr std::string_view kWrite = "[[device.write]]\n";
  text.insert(text.find(kWrite),
              fmt::format("{}kind = \"holding_register\"\naddress = {}\nimage = \"t.out\"\n", kWrite,
                          ModbusPeer::kRegisters));
  const std::string config = plant.write(text);
  bool in_time = false;  // a device that refuses one late is left with what it has
  for (int round = 0; round < 5 && !in_time; ++round) {
    ModbusProgram sut(plant, config, fmt::format("{}.log", round));
    ASSERT_TRUE(follows(plant, peer, 99)) << sut.log();
    EXPECT_EQ(sut.end(SIGTERM), 0);
    EXPECT_TRUE(sut.logged("its outputs from address 300 were not set to zero")) << sut.log();
    in_time = !sut.logged("its outputs from address 7 were not set to zero");
  }
  EXPECT_TRUE(in_time);
  EXPECT_TRUE(becomes_zero(peer, 7));
}

TEST(ModbusProcess, TheEndReachesADeviceBetweenTwoAttemptsToConnect) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  std::string text = device(port);
  text.replace(text.find("reconnect_ms = 100"), 18, "reconnect_ms = 3600000");
  text.replace(text.find("reconnect_max_ms = 200"), 22, "reconnect_max_ms = 3600000");
  text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 10000");  // it loses no response before
  ModbusProgram sut(plant, plant.write(text));
  ASSERT_TRUE(follows(plant, peer, 99)) << sut.log();
  peer.set(Mode::garbage);
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::lost); })) << sut.log();
  peer.set(Mode::normal);
  EXPECT_EQ(peer.holding(7), 99);
  EXPECT_EQ(sut.end(SIGTERM), 0);
  EXPECT_TRUE(becomes_zero(peer, 7)) << sut.log();
}

// The response would be waited for until its timeout.
TEST(ModbusProcess, TheEndWaitsForNoStalledDevice) {
  Plant plant;
  const HeldPort port;
  std::string text = device(port);
  text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 10000");
  const std::string config = plant.write(text);
  bool in_order = false;  // a machine that stands still has the process end without the device's thread
  for (int round = 0; round < 5 && !in_order; ++round) {
    const ModbusPeer peer(port, Mode::stalls);
    ModbusProgram sut(plant, config, fmt::format("{}.log", round));
    ASSERT_TRUE(eventually([&] { return peer.requests() == 1; })) << sut.log();
    const auto begin = MonotonicClock::now();
    EXPECT_EQ(sut.end(SIGTERM), 0);
    RecordProperty("ms", static_cast<int>((MonotonicClock::now() - begin) / 1ms));
    EXPECT_FALSE(sut.logged("is lost: Connection timed out")) << sut.log();
    in_order = sut.logged("plchost-modbus: ended");
  }
  EXPECT_TRUE(in_order);
}

// 48 coils, which the device switches in 1.4 s. The end comes when `last` of them is on: also in the first
// poll.
TEST(ModbusProcess, TheEndSwitchesOffAllCoilsOfADeviceThatTakesOneByOne) {
  for (const int last : {0, 47}) {
    Plant plant;
    const HeldPort port;
    ModbusPeer peer(port, Mode::slow);
    std::string text = device(port, "silent_after_ms = 600000");
    text.resize(text.find("[[device.read]]"));
    for (const int address : {0, 16, 32}) {
      text += fmt::format("[[device.write]]\nkind = \"coil\"\naddress = {}\ncount = 16\nimage = \"t.out\"\n",
                          address);
      text += "function = \"single\"\nrewrite_ms = 0\n";
    }
    plant.put_out(0, 0xffff);
    ModbusProgram sut(plant, plant.write(text));
    ASSERT_TRUE(eventually([&] { return peer.coil(last) == 1; })) << sut.log();
    EXPECT_EQ(sut.end(SIGTERM), 0);
    peer.set(Mode::normal);
    EXPECT_TRUE(eventually([&] {
      int on = 0;
      for (int i = 0; i < 48; ++i) on += peer.coil(i);
      return on == 0;
    })) << last
        << sut.log();
  }
}

TEST(ModbusProcess, AnImageHasOneWriter) {
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

// Without an input image nothing else would keep the second one off the devices.
TEST(ModbusProcess, AFileHasOneProcess) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  std::string text = device(port);
  text.erase(text.find("status_image"),
             std::string_view("status_image = \"t.in\"\nstatus_offset = 56\n").size());
  text.erase(text.find("[[device.read]]"), text.find("[[device.write]]") - text.find("[[device.read]]"));
  const std::string config = plant.write(text);
  ModbusProgram first(plant, config);
  ASSERT_TRUE(follows(plant, peer, 99)) << first.log();
  ModbusProgram second(plant, config, "second.log");
  EXPECT_EQ(second.end(), 1);
  EXPECT_THAT(second.log(), HasSubstr(config + ": another plchost-modbus runs with this file"));
  EXPECT_TRUE(follows(plant, peer, 98));
  EXPECT_EQ(first.end(SIGKILL), -SIGKILL);
  const ModbusProgram third(plant, config, "third.log");
  EXPECT_TRUE(follows(plant, peer, 97)) << third.log();
}

// A file of the same pool with an input image of its own.
std::string other_file(const Plant& plant, std::string text) {
  const std::string file = plant.write(text);
  std::ifstream in(file);
  text.assign(std::istreambuf_iterator<char>(in), {});
  for (std::size_t at = text.find("t.in"); at != std::string::npos; at = text.find("t.in", at + 8))
    text.replace(at, 4, "other.in");
  std::ofstream(file) << text;
  return file;
}

TEST(ModbusProcess, TheOutputsOfADeviceHaveOneProcess) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  const std::string config = plant.write(device(port));
  ModbusProgram first(plant, config);
  ASSERT_TRUE(follows(plant, peer, 99)) << first.log();
  std::string text = device(port);
  const std::string mapped = fmt::format("[::ffff:127.0.0.1]:{}", port.number());
  text.replace(text.find(port.address()), port.address().size(), mapped);
  ModbusProgram second(plant, other_file(plant, text), "second.log");
  EXPECT_EQ(second.end(), 1);
  EXPECT_THAT(second.log(), HasSubstr(fmt::format(
                                "device 'valves': process {} (plchost-modbus --config {}) writes the outputs "
                                "of {}/1; end that one, or put all maps of the device into one file",
                                first.pid(), config, port.address())));
  EXPECT_TRUE(follows(plant, peer, 98)) << "nothing of the first one changes";
  EXPECT_EQ(first.end(SIGKILL), -SIGKILL);
  const ModbusProgram third(plant, other_file(plant, text), "third.log");
  EXPECT_TRUE(follows(plant, peer, 97)) << third.log();
}

// The files of claims in the pool of the plant.
std::vector<std::filesystem::path> claims(const Plant& plant) {
  std::vector<std::filesystem::path> found;
  for (const auto& file : std::filesystem::directory_iterator("/dev/shm")) {
    const std::string name = file.path().filename();
    if (name.starts_with(plant.pool()) && name.find("modbus") != name.rfind("modbus"))
      found.push_back(file.path());
  }
  return found;
}

// A process that writes the outputs stands still while its claim is removed, and another one with an output
// at register 20 is faster.
struct Overtaken {
  Overtaken() {
    EXPECT_TRUE(follows(plant, peer, 99)) << first.log();
    ::kill(first.pid(), SIGSTOP);
    for (const auto& claim : claims(plant)) std::filesystem::remove(claim);
    std::string text = device(port);
    text.replace(text.find("address = 7"), 11, "address = 20");
    second.emplace(plant, other_file(plant, text), "second.log");
    EXPECT_TRUE(reaches_second(98)) << second->log();
    ::kill(first.pid(), SIGCONT);
  }
  bool reaches_second(std::uint16_t word) {
    return eventually([&] {
      plant.put_out(0, word);
      return peer.holding(20) == word;
    });
  }

  Plant plant;
  HeldPort port;
  ModbusPeer peer{port};
  ModbusProgram first{plant, plant.write(device(port))};
  std::optional<ModbusProgram> second;
};

TEST(ModbusProcess, AProcessWhoseClaimAnotherOneHasWritesNoOutputs) {
  Overtaken at;
  EXPECT_TRUE(eventually([&] { return quality_is(at.plant, 56, Quality::lost); })) << at.first.log();
  EXPECT_TRUE(eventually([&] { return at.first.logged("is lost: another process writes its outputs"); }));
  EXPECT_TRUE(eventually(
      [&] { return at.first.logged(fmt::format("process {} (plchost-modbus", at.second->pid())); }));
  const int before = at.peer.holding(7);
  EXPECT_TRUE(at.reaches_second(97));
  EXPECT_EQ(at.peer.holding(7), before);
  EXPECT_EQ(at.second->end(SIGTERM), 0);
  EXPECT_TRUE(follows(at.plant, at.peer, 96)) << "the claim is free: " << at.first.log();
  EXPECT_TRUE(eventually([&] { return quality_is(at.plant, 56, Quality::good); }));
}

TEST(ModbusProcess, TheEndTellsThatAnotherProcessWritesTheOutputs) {
  Overtaken at;
  ASSERT_TRUE(eventually([&] { return at.first.logged("is lost: another process"); })) << at.first.log();
  EXPECT_EQ(at.first.end(SIGTERM), 0);
  EXPECT_TRUE(at.first.logged("its outputs stay as they are: another process writes them")) << at.first.log();
  EXPECT_NE(at.peer.holding(7), 0);
}

// The end of a host removes the files of its pool.
TEST(ModbusProcess, TheClaimOfOutputsIsTakenAgainWhenItsFileIsRemoved) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  const ModbusProgram first(plant, plant.write(device(port)));
  ASSERT_TRUE(follows(plant, peer, 99)) << first.log();
  remove_pool_memories(plant.pool());
  ASSERT_TRUE(eventually([&] { return !claims(plant).empty(); })) << first.log();
  ModbusProgram second(plant, other_file(plant, device(port)), "second.log");
  EXPECT_EQ(second.end(), 1);
  EXPECT_THAT(second.log(), HasSubstr("writes the outputs of"));
}

TEST(ModbusProcess, TheClaimOfOutputsIsTakenAgainWhenItsFileIsCutShort) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  ModbusProgram first(plant, plant.write(device(port)));
  ASSERT_TRUE(follows(plant, peer, 99)) << first.log();
  const auto held = claims(plant);
  ASSERT_EQ(held.size(), 1U);
  const auto size = std::filesystem::file_size(held.front());
  std::filesystem::resize_file(held.front(), 0);
  ASSERT_TRUE(eventually([&] { return std::filesystem::file_size(held.front()) == size; })) << first.log();
  EXPECT_TRUE(follows(plant, peer, 98)) << first.log();
  ModbusProgram second(plant, other_file(plant, device(port)), "second.log");
  EXPECT_EQ(second.end(), 1);
  EXPECT_EQ(first.end(SIGTERM), 0);
  EXPECT_FALSE(first.logged("writes the outputs")) << first.log();
}

TEST(ModbusProcess, DevicesThatOtherProcessesOnlyReadAndOtherUnitsAreFree) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  const ModbusProgram first(plant, plant.write(device(port)));
  ASSERT_TRUE(follows(plant, peer, 99)) << first.log();
  std::string reads = device(port);
  reads.resize(reads.find("[[device.write]]"));
  ModbusProgram second(plant, other_file(plant, reads), "second.log");
  EXPECT_TRUE(eventually([&] { return second.logged("device 'valves' answers"); })) << second.log();
  EXPECT_EQ(second.end(SIGTERM), 0);
  const ModbusProgram third(plant, other_file(plant, device(port, "unit = 2")), "third.log");
  EXPECT_TRUE(eventually([&] { return third.logged("device 'valves' answers"); })) << third.log();
}

// By the status alone a PLC would take inputs for good whose firmware is gone.
TEST(ModbusProcess, APlcSeesThatTheProcessIsGoneOrStandsStill) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  ModbusProgram sut(plant, plant.write(device(port)));
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::good); })) << sut.log();
  for (int i = 0; i < 3; ++i) {
    const auto counter = plant.status(56).counter;
    EXPECT_TRUE(eventually([&] { return plant.status(56).counter != counter; }));
  }
  EXPECT_EQ(sut.end(SIGKILL), -SIGKILL);
  const auto counter = plant.status(56).counter;
  std::this_thread::sleep_for(200ms);
  EXPECT_EQ(plant.status(56).counter, counter);
}

TEST(ModbusProcess, TheEndOfItsTerminalIsAnEndInOrder) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  ModbusProgram sut(plant, plant.write(device(port)));
  ASSERT_TRUE(follows(plant, peer, 99)) << sut.log();
  plant.put_out(0, 99);
  EXPECT_EQ(sut.end(SIGHUP), 0);
  EXPECT_TRUE(becomes_zero(peer, 7));
}

TEST(ModbusProcess, AKilledProcessLeavesAnImageThatTheNextTakesOver) {
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
  EXPECT_TRUE(eventually([&] {
    return plant.status(56).quality != 1 && plant.status(56).age_ms == modbus::kNeverRead;
  })) << second.log();
  EXPECT_EQ(plant.input_word(0), 5);
  peer.set(Mode::normal);
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::good); }));
}

// The end of the first process has made them zero, or the silence before; no task has put them out since.
TEST(ModbusProcess, AStartSwitchesKeptOutputsNotOnAgain) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  const std::string config = plant.write(device(port));
  for (const int signal : {SIGTERM, SIGKILL}) {
    ModbusProgram first(plant, config);
    ASSERT_TRUE(follows(plant, peer, 99)) << first.log();
    plant.keep(PLC_IMAGE_STATE_STOPPED);
    EXPECT_EQ(first.end(signal), signal == SIGTERM ? 0 : -signal);
    peer.with([](modbus_mapping_t& mapping) { mapping.tab_registers[7] = 0; });  // its watchdog
    const ModbusProgram second(plant, config, "second.log");
    const int requests = peer.requests();
    ASSERT_TRUE(eventually([&] {
      plant.beat();
      return peer.requests() > requests + 100;  // of 10 ms and more
    })) << second.log();
    EXPECT_EQ(peer.holding(7), 0) << second.log();
    plant.run();
    EXPECT_TRUE(follows(plant, peer, 98)) << second.log();
  }
}

// Words of an image that is opened anew.
::testing::AssertionResult first_word_becomes(const Plant& plant, const char* name, std::uint16_t wanted) {
  plc_image image{};
  std::array<std::uint16_t, Plant::kSize / 2> words{};
  const bool opened = eventually(
      [&] { return plc_image_open(plant.pool().c_str(), name, Plant::kSize, PLC_IMAGE_READ, &image) == 0; });
  const bool came =
      opened && eventually([&] {
        return plc_image_read(&image, words.data(), nullptr) == PLC_IMAGE_OK && words[0] == wanted;
      });
  plc_image_close(&image);
  return came ? ::testing::AssertionSuccess() : ::testing::AssertionFailure() << "it is " << words[0];
}

// The files of a host that has ended are not made again by firmware.
TEST(ModbusProcess, AnImageWhoseFileIsRemovedIsThatOfTheNextOneWhoMakesIt) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  measure(peer, 5);
  const ModbusProgram sut(plant, plant.write(device(port)));
  ASSERT_TRUE(eventually([&] { return plant.input_word(0) == 5; })) << sut.log();
  const std::string path = fmt::format("/dev/shm/{}.memory.t.in", plant.pool());
  ASSERT_EQ(::unlink(path.c_str()), 0);
  measure(peer, 6);
  ASSERT_TRUE(eventually([&] { return plant.input_word(0) == 6; })) << "a process that has it open sees all";
  EXPECT_NE(::access(path.c_str(), F_OK), 0);
  EXPECT_TRUE(first_word_becomes(plant, "t.in", 6));
}

TEST(ModbusProcess, AnImageWhoseFileIsCutShortIsOpenedAnew) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  measure(peer, 5);
  const ModbusProgram sut(plant, plant.write(device(port)));
  ASSERT_TRUE(eventually([&] { return plant.input_word(0) == 5; })) << sut.log();
  ASSERT_EQ(::truncate(fmt::format("/dev/shm/{}.memory.t.in", plant.pool()).c_str(), 0), 0);
  measure(peer, 6);
  EXPECT_TRUE(first_word_becomes(plant, "t.in", 6)) << sut.log();
}

// An instance whose settings have another Size, once the file was removed.
TEST(ModbusProcess, AnImageThatComesWithAnotherSizeIsTold) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  const ModbusProgram sut(plant, plant.write(device(port)));
  ASSERT_TRUE(follows(plant, peer, 42)) << sut.log();
  ASSERT_EQ(::unlink(fmt::format("/dev/shm/{}.memory.t.out", plant.pool()).c_str()), 0);
  plc_image other{};
  ASSERT_EQ(plc_image_open(plant.pool().c_str(), "t.out", Plant::kSize + 64, PLC_IMAGE_WRITE, &other), 0);
  EXPECT_TRUE(eventually([&] { return sut.logged("an image of another size"); })) << sut.log();
  EXPECT_TRUE(eventually([&] { return peer.holding(7) == 0; })) << "the one before is silent";
  plc_image_close(&other);
}

TEST(ModbusProcess, ABadConfigurationIsRefusedWithItsLine) {
  Plant plant;
  const std::string file = plant.write("[[device]]\nname = \"d\"\ntcp = \"somewhere\"\n");
  ModbusProgram sut(plant, file);
  EXPECT_EQ(sut.end(), 1);
  EXPECT_THAT(sut.log(), HasSubstr(file + ":13:1: [[device]] 'd' tcp: \"somewhere\" is no address"));
}

}  // namespace
}  // namespace plchost::testing
