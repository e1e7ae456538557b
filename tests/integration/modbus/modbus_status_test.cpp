// The status of a device and the log are true: no zeros that are good, no advice that does not fit.

#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <string>
#include <thread>

#include <gmock/gmock.h>

#include "tests/integration/modbus/device_of_a_test.hpp"
#include "tests/integration/modbus/modbus_peer.hpp"
#include "tests/integration/modbus/modbus_program.hpp"
#include "tests/integration/modbus/scripted_line.hpp"

namespace plchost::testing {
namespace {

using modbus::Quality;
using Mode = ModbusPeer::Mode;
using Bytes = ScriptedLine::Bytes;

// The input register and the status of device(), of one image.
struct Inputs {
  std::uint16_t value = 0;
  modbus::DeviceStatus status;
};
Inputs inputs_of(const Plant& plant) {
  const auto bytes = plant.inputs();
  Inputs inputs;
  std::memcpy(&inputs.value, bytes.data(), sizeof inputs.value);
  std::memcpy(&inputs.status, bytes.data() + 56, sizeof inputs.status);
  return inputs;
}

// A device answers each request, and two polls take longer than gone_after_ms.
TEST(ModbusStatus, ZerosInPlaceOfOldInputsAreNotGood) {
  for (const char* const gone_after : {"gone_after_ms = 45", "gone_after_ms = 20"}) {
    Plant plant;
    const HeldPort port;
    ModbusPeer peer(port, Mode::slow);
    measure(peer, 5);
    std::string text = device(port, "when_gone = \"zero\"");
    text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 10000");
    text.replace(text.find("gone_after_ms = 300"), 19, gone_after);
    const ModbusProgram sut(plant, plant.write(text));
    int zeros = 0;
    int good_zeros = 0;
    ASSERT_TRUE(eventually([&] {
      const Inputs inputs = inputs_of(plant);
      const bool is_good = inputs.status.quality == static_cast<std::uint16_t>(Quality::good);
      if (inputs.value == 0 && inputs.status.age_ms != modbus::kNeverRead) ++zeros;
      if (inputs.value == 0 && is_good) ++good_zeros;
      return peer.requests() > 40 && zeros > 0;
    })) << sut.log();
    EXPECT_EQ(good_zeros, 0) << "of " << zeros << " with " << gone_after;
    EXPECT_TRUE(eventually([&] { return sut.logged(std::string("and zero at ") + gone_after); }))
        << sut.log();
    EXPECT_FALSE(sut.logged("is lost")) << sut.log();
  }
}

// The first images after it are those of before.
TEST(ModbusStatus, InputsAreZeroAndNotGoodWhenTheProcessHasStoodStill) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  measure(peer, 5);
  const ModbusProgram sut(plant, plant.write(device(port, "when_gone = \"zero\"")));
  ASSERT_TRUE(eventually([&] { return inputs_of(plant).value == 5; })) << sut.log();
  peer.set(Mode::stalls);
  ::kill(sut.pid(), SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  ::kill(sut.pid(), SIGCONT);
  ASSERT_TRUE(eventually([&] { return inputs_of(plant).value == 0; })) << sut.log();
  EXPECT_FALSE(quality_is(plant, 56, Quality::good)) << sut.log();
}

// Its settings keep the outputs, which the start of this process does not know.
TEST(ModbusStatus, ASilenceThatIsThereAtTheStartIsTold) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  peer.with([](modbus_mapping_t& mapping) { mapping.tab_registers[7] = 7777; });
  plant.put_out(0, 99);
  plant.keep(PLC_IMAGE_STATE_STOPPED);
  const ModbusProgram sut(plant, plant.write(device(port)));
  ASSERT_TRUE(eventually([&] {
    plant.beat();
    return peer.holding(7) == 0;
  })) << sut.log();
  EXPECT_TRUE(sut.logged("the PLC of image 't.out' is silent: outputs from address 7 become zero"))
      << sut.log();
  EXPECT_EQ(sut.told("is silent"), 1) << sut.log();
}

// serial_device() with two inputs, and without outputs.
std::string reader(const std::string& path, const SerialLine& line) {
  std::string text = serial_device(line, 1, 0);
  text.resize(text.find("[[device.write]]"));
  text.replace(text.find(line.path()), line.path().size(), path);
  return text + "count = 2\n";
}

TEST(ModbusStatus, ALineThatIsNotThereGetsNoAdviceForItsDevice) {
  Plant plant;
  const SerialLine line;
  const ModbusProgram sut(plant, plant.write(reader("/nonexistent", line)));
  ASSERT_TRUE(eventually([&] { return sut.logged("device 'unit1' is lost: /nonexistent: "); })) << sut.log();
  EXPECT_FALSE(sut.logged("set probe")) << sut.log();
  EXPECT_FALSE(sut.logged("to tell late responses apart")) << "nothing was asked: " << sut.log();
}

TEST(ModbusStatus, GarbageIsNoReasonToAskWithoutProbes) {
  Plant plant;
  const SerialLine line;
  const ScriptedLine device(line, [&](const Bytes& request) {
    Bytes frame = ScriptedLine::response(request, 11);
    frame.back() ^= 0x10U;
    ScriptedLine::send(line, frame);
  });
  std::string text = reader(line.path(), line);
  text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 10000");
  const ModbusProgram sut(plant, plant.write(text));
  ASSERT_TRUE(eventually([&] { return sut.logged("device 'unit1' is lost: Invalid CRC"); })) << sut.log();
  EXPECT_TRUE(sut.logged("to tell late responses apart")) << sut.log();
  EXPECT_FALSE(sut.logged("set probe")) << sut.log();
}

}  // namespace
}  // namespace plchost::testing
