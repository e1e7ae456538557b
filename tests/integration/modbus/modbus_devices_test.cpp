// plchost-modbus between images and real devices of libmodbus, which stall, vanish and answer garbage.

#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/integration/modbus/device_of_a_test.hpp"
#include "tests/integration/modbus/modbus_peer.hpp"
#include "tests/integration/modbus/modbus_program.hpp"

namespace plchost::testing {
namespace {

using modbus::Quality;
using Mode = ModbusPeer::Mode;

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
  ASSERT_TRUE(follows(plant, peer, 99)) << sut.log();
  EXPECT_TRUE(eventually([&] { return peer.holding(7) == 0; }));  // nothing is put out any more
}

TEST(ModbusDevices, ASilentPlcsOutputsStayIfSo) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  ModbusProgram sut(plant, plant.write(device(port, "silent_after_ms = 200\nwhen_silent = \"keep\"")));
  ASSERT_TRUE(follows(plant, peer, 99)) << sut.log();
  const int requests = peer.requests();
  ASSERT_TRUE(eventually([&] { return peer.requests() > requests + 100; }));  // of 10 ms and more
  EXPECT_EQ(peer.holding(7), 99);
  EXPECT_EQ(sut.end(SIGTERM), 0);
  EXPECT_EQ(peer.holding(7), 99);
}

// The PLC says which outputs hold. They do as long as it gives signs, and after its end in any case.
TEST(ModbusDevices, TheSafeStateOfAPlcIsNoSilence) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  const ModbusProgram sut(plant, plant.write(device(port, "silent_after_ms = 300")));
  ASSERT_TRUE(follows(plant, peer, 99)) << sut.log();
  plant.show_safe(PLC_IMAGE_STATE_STOPPED, 7);
  ASSERT_TRUE(eventually([&] {
    plant.beat();
    return peer.holding(7) == 7;
  }));
  EXPECT_TRUE(eventually([&] { return peer.holding(7) == 0; }));  // no sign any more
  plant.show_safe(PLC_IMAGE_STATE_ENDED, 8);
  ASSERT_TRUE(eventually([&] { return peer.holding(7) == 8; }));
  const int requests = peer.requests();
  ASSERT_TRUE(eventually([&] { return peer.requests() > requests + 100; }));  // of 10 ms and more
  EXPECT_EQ(peer.holding(7), 8);
}

TEST(ModbusDevices, APlcThatDiesInItsSilenceSwitchesNothingOnAgain) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  const ModbusProgram sut(plant, plant.write(device(port, "silent_after_ms = 300")));
  ASSERT_TRUE(follows(plant, peer, 99)) << sut.log();
  ASSERT_TRUE(eventually([&] { return peer.holding(7) == 0; }));
  plant.die_and_keep();
  const int requests = peer.requests();
  ASSERT_TRUE(eventually([&] { return peer.requests() > requests + 100; }));  // of 10 ms and more
  EXPECT_EQ(peer.holding(7), 0);
  plant.run();
  EXPECT_TRUE(follows(plant, peer, 98)) << "of its next process";
}

// A watchdog that hits, the next process and the end come behind the silence.
TEST(ModbusDevices, KeptOutputsThatSilenceHasClearedAreNotSwitchedOnAgain) {
  for (const unsigned state :
       {PLC_IMAGE_STATE_STOPPED, PLC_IMAGE_STATE_EXCEPTION, PLC_IMAGE_STATE_HALTED, PLC_IMAGE_STATE_ENDED}) {
    Plant plant;
    const HeldPort port;
    ModbusPeer peer(port);
    const ModbusProgram sut(plant, plant.write(device(port, "silent_after_ms = 300")));
    ASSERT_TRUE(follows(plant, peer, 99)) << sut.log();
    const int silences = sut.told("is silent");
    plant.keep(state);
    const int before = peer.requests();
    ASSERT_TRUE(eventually([&] {
      plant.beat();
      return peer.requests() > before + 100;
    }));
    EXPECT_TRUE(sut.told("is silent") > silences || peer.holding(7) == 99)
        << "without a silence they are kept";
    plant.show_safe(PLC_IMAGE_STATE_RUNNING, 99, false);
    ASSERT_TRUE(eventually([&] { return peer.holding(7) == 0; }));
    plant.keep(state);
    const int requests = peer.requests();
    ASSERT_TRUE(eventually([&] {
      plant.beat();
      return peer.requests() > requests + 100;  // of 10 ms and more
    }));
    EXPECT_EQ(peer.holding(7), 0) << state;
    plant.show_safe(PLC_IMAGE_STATE_EXCEPTION, 7);
    EXPECT_TRUE(eventually([&] {
      plant.beat();
      return peer.holding(7) == 7;
    })) << "values that the settings name hold";
  }
}

// The end of a host removes its images.
TEST(ModbusDevices, TheSafeStateHoldsWhenTheImageIsGoneUntilAnotherPlcWrites) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  const ModbusProgram sut(plant, plant.write(device(port, "silent_after_ms = 300")));
  plant.show_safe(PLC_IMAGE_STATE_ENDED, 8);
  ASSERT_TRUE(eventually([&] { return peer.holding(7) == 8; })) << sut.log();
  const std::string path = fmt::format("/dev/shm/{}.memory.t.out", plant.pool());
  ASSERT_EQ(::unlink(path.c_str()), 0);
  int requests = peer.requests();
  ASSERT_TRUE(eventually([&] { return peer.requests() > requests + 200; }));  // of 10 ms and more
  EXPECT_EQ(peer.holding(7), 8);
  EXPECT_NE(::access(path.c_str(), F_OK), 0);
  plc_image next{};
  ASSERT_EQ(plc_image_open(plant.pool().c_str(), "t.out", Plant::kSize, PLC_IMAGE_WRITE, &next), 0);
  requests = peer.requests();
  ASSERT_TRUE(eventually([&] { return peer.requests() > requests + 100; }));
  EXPECT_EQ(peer.holding(7), 8) << "nothing is put out yet";
  const std::array<std::uint16_t, Plant::kSize / 2> words{43};
  EXPECT_TRUE(eventually([&] {
    plc_image_write(&next, words.data());
    return peer.holding(7) == 43;
  })) << sut.log();
  const int silences = sut.told("the PLC of image 't.out' is silent");
  plc_image_close(&next);
  EXPECT_TRUE(eventually([&] { return sut.told("the PLC of image 't.out' is silent") > silences; }));
}

// A device whose PLC was stopped or killed was cleared before there were safe states, and still is.
TEST(ModbusDevices, APlcThatNamesNoSafeStateIsSilentWhenItStops) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  const ModbusProgram sut(plant, plant.write(device(port, "silent_after_ms = 300")));
  for (const unsigned state : {PLC_IMAGE_STATE_STOPPED, PLC_IMAGE_STATE_ENDED}) {
    plant.show_safe(PLC_IMAGE_STATE_UNTOLD, 99, false);
    ASSERT_TRUE(follows(plant, peer, 99)) << sut.log();
    plant.show_safe(state, 99, false);
    EXPECT_TRUE(eventually([&] {
      plant.beat();
      return peer.holding(7) == 0;
    })) << state;
  }
}

// A port whose queue of connections is full: one more is made when another one is taken out.
class FullPort {
 public:
  FullPort() : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    address_.sin_family = AF_INET;
    address_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address_;
    EXPECT_EQ(::bind(listener_.get(), generic(), size), 0);
    EXPECT_EQ(::getsockname(listener_.get(), generic(), &size), 0);
    EXPECT_EQ(::listen(listener_.get(), 0), 0);
    first_ = UniqueFd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    EXPECT_EQ(::connect(first_.get(), generic(), size), 0);
  }
  [[nodiscard]] std::string address() const { return fmt::format("127.0.0.1:{}", ntohs(address_.sin_port)); }
  [[nodiscard]] UniqueFd accept() const {
    return UniqueFd(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
  }

 private:
  sockaddr* generic() { return reinterpret_cast<sockaddr*>(&address_); }
  UniqueFd listener_;
  UniqueFd first_;
  sockaddr_in address_{};
};

TEST(ModbusDevices, OutputsDoNotGrowOldWhileAConnectionIsMade) {
  Plant plant;
  const FullPort port;
  plant.put_out(0, 0x0815);
  const ModbusProgram sut(plant, plant.write(fmt::format(R"(
[[device]]
name = "valves"
tcp = "{}"
timeout_ms = 10000
silent_after_ms = 600000
[[device.write]]
kind = "holding_register"
address = 7
image = "t.out"
)",
                                                         port.address())));
  ASSERT_TRUE(eventually([&] { return sut.logged("says the outputs from address 7"); })) << sut.log();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // it connects
  plant.put_out(0, 0x0042);
  (void)port.accept();
  const UniqueFd device = port.accept();
  std::array<std::uint8_t, 12> request{};
  ASSERT_EQ(::recv(device.get(), request.data(), request.size(), MSG_WAITALL), 12);
  EXPECT_EQ(request[10] << 8U | request[11], 0x0042);
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
  // The new device has forgotten the outputs: they are written again, although they have not changed.
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

// It may have looked at its inputs as soon as it was asked.
TEST(ModbusDevices, TheAgeOfInputsCountsFromTheirRequest) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port, ModbusPeer::Mode::slow);
  const ModbusProgram sut(plant, plant.write(device(port)));
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::good); })) << sut.log();
  const int requests = peer.requests();
  ASSERT_TRUE(eventually([&] {
    EXPECT_GE(std::int64_t{plant.status(56).age_ms}, ModbusPeer::kSlow.count());
    return peer.requests() > requests + 10;
  }));
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

struct WrongAnswer {
  Mode mode;
  const char* told;
};
class ModbusWrongAnswer : public ::testing::TestWithParam<WrongAnswer> {};

// A gateway that mixes up its devices answers so. Its values are not taken.
TEST_P(ModbusWrongAnswer, IsALostDevice) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port, GetParam().mode);
  measure(peer, 5);
  const ModbusProgram sut(plant, plant.write(device(port)));
  EXPECT_TRUE(eventually([&] {
    plant.put_out(0, 99);
    return sut.logged(GetParam().told);
  })) << sut.log();
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::lost); }));
  EXPECT_EQ(plant.input_word(0), 0);
  peer.set(Mode::normal);
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::good) && plant.input_word(0) == 5; }));
}
INSTANTIATE_TEST_SUITE_P(Each, ModbusWrongAnswer,
                         ::testing::Values(WrongAnswer{Mode::other_unit,
                                                       "the response is of unit 2, not of 1"},
                                           WrongAnswer{Mode::other_length, "is lost: the response"},
                                           WrongAnswer{Mode::other_protocol, "the response is no Modbus"},
                                           WrongAnswer{Mode::other_write, "confirms another address"}));

TEST(ModbusDevices, AnExceptionThatNoStandardNamesIsShown) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port, Mode::own_exception);
  const ModbusProgram sut(plant, plant.write(device(port)));
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::exception); })) << sut.log();
  EXPECT_EQ(plant.status(56).exception, ModbusPeer::kOwnException);
  EXPECT_TRUE(eventually([&] { return sut.logged("refuses a request with exception 33"); })) << sut.log();
}

// It may have been switched off meanwhile, so it gets its outputs again.
TEST(ModbusDevices, ADeviceThatEndsAConnectionAtRestIsNotLost) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port, Mode::ends);
  std::string text = device(port);
  text.replace(text.find("poll_ms = 10"), 12, "poll_ms = 50");
  text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 10000");
  const ModbusProgram sut(plant, plant.write(text + "rewrite_ms = 0\n"));
  ASSERT_TRUE(follows(plant, peer, 99)) << sut.log();
  peer.with([](modbus_mapping_t& mapping) { mapping.tab_registers[7] = 0; });
  EXPECT_TRUE(follows(plant, peer, 99)) << "unchanged, on another connection";
  EXPECT_TRUE(quality_is(plant, 56, Quality::good));
  EXPECT_FALSE(sut.logged("is lost")) << sut.log();
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
  for (std::uint16_t value = 1; value <= 20; ++value) {
    measure(peer, value);
    ASSERT_TRUE(eventually([&] { return plant.input_word(0) == value; }));
  }
  EXPECT_EQ(stalled.requests(), 1);  // all the time it has waited for its answer
}

}  // namespace
}  // namespace plchost::testing
