// Serial lines with noise, with responses that come late, and with devices that know only part of Modbus.

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include <gmock/gmock.h>

#include "tests/integration/modbus/device_of_a_test.hpp"
#include "tests/integration/modbus/modbus_peer.hpp"
#include "tests/integration/modbus/modbus_program.hpp"
#include "tests/integration/modbus/scripted_line.hpp"

namespace plchost::testing {
namespace {

using modbus::Quality;
using namespace std::chrono_literals;
using Bytes = ScriptedLine::Bytes;

// serial_device() of unit 1 or 2 without outputs.
std::string reader(const SerialLine& line, int unit, int offset) {
  std::string text = serial_device(line, unit, offset);
  text.resize(text.find("[[device.write]]"));
  return text;
}

// Unit 1 answers too late, so its response comes while unit 2 is asked.
TEST(ModbusNoise, ALateResponseOfAnotherUnitIsPassedOver) {
  Plant plant;
  const SerialLine line;
  Bytes late;
  std::atomic<int> answered{0};
  const ScriptedLine devices(line, [&](const Bytes& request) {
    if (request[0] == 1) {
      late = ScriptedLine::response(request, 11);
      return;
    }
    ScriptedLine::send(line, late);
    std::this_thread::sleep_for(10ms);
    ScriptedLine::send(line, ScriptedLine::response(request, 22));
    if (!late.empty()) ++answered;
  });
  std::string healthy = reader(line, 2, 8);
  healthy.replace(healthy.find("timeout_ms = 200"), 16, "timeout_ms = 10000");
  const ModbusProgram sut(plant, plant.write(reader(line, 1, 0) + healthy));
  ASSERT_TRUE(eventually([&] { return answered >= 20; })) << sut.log();
  EXPECT_EQ(plant.input_word(8), 22);
  EXPECT_TRUE(quality_is(plant, 48, Quality::good));
  EXPECT_FALSE(sut.logged("device 'unit2' is lost")) << sut.log();
  EXPECT_TRUE(eventually([&] { return sut.logged("device 'unit1' is lost"); })) << sut.log();
}

enum class Noise { checksum, cut_off, other_unit, more_before };
class ModbusNoiseOf : public ::testing::TestWithParam<Noise> {};

// Each third response of a device is garbled. The rest of one that is cut off is waited for.
TEST_P(ModbusNoiseOf, OneResponseIsNoReasonToGiveADeviceUp) {
  Plant plant;
  const SerialLine line;
  std::atomic<int> requests{0};
  const ScriptedLine device(line, [&](const Bytes& request) {
    Bytes frame = ScriptedLine::response(request, 11);
    if (++requests % 3 == 0) {
      if (GetParam() == Noise::checksum) frame[3] ^= 0x10U;
      if (GetParam() == Noise::cut_off) frame.resize(4);
      if (GetParam() == Noise::other_unit) frame[0] ^= 0x10U;
      if (GetParam() == Noise::more_before) frame.insert(frame.begin(), {1, 4});
    }
    ScriptedLine::send(line, frame);
  });
  const bool is_waited_for = GetParam() == Noise::cut_off || GetParam() == Noise::other_unit;
  std::string text = serial_device(line, 1, 0);
  text.replace(text.find("timeout_ms = 200"), 16, is_waited_for ? "timeout_ms = 1000" : "timeout_ms = 10000");
  const ModbusProgram sut(plant, plant.write(text));
  bool was_lost = false;  // it would be so for 100 ms
  ASSERT_TRUE(eventually([&] {
    plant.put_out(0, static_cast<std::uint16_t>(requests.load()));
    was_lost = was_lost || quality_is(plant, 40, Quality::lost);
    return requests >= (is_waited_for ? 8 : 40);
  })) << sut.log();
  EXPECT_TRUE(quality_is(plant, 40, Quality::good));
  EXPECT_EQ(plant.input_word(0), 11);
  EXPECT_FALSE(was_lost) << sut.log();
}
INSTANTIATE_TEST_SUITE_P(Each, ModbusNoiseOf,
                         ::testing::Values(Noise::checksum, Noise::cut_off, Noise::other_unit,
                                           Noise::more_before));

// The end may not leave outputs on because of one frame.
TEST(ModbusNoise, TheEndSetsOutputsThoughOneResponseIsGarbled) {
  Plant plant;
  const SerialLine line;
  std::atomic<int> output{0};
  std::atomic<bool> ends{false};
  std::atomic<int> zeros{0};
  const ScriptedLine device(line, [&](const Bytes& request) {
    Bytes frame = ScriptedLine::response(request, 11);
    if (request[1] == 16) output = request[8];
    const bool is_garbled = request[1] == 16 && ends && ++zeros == 1;
    if (is_garbled) frame[3] ^= 0x10U;
    ScriptedLine::send(line, frame);
  });
  std::string text = serial_device(line, 1, 0);
  text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 10000\nsilent_after_ms = 600000");
  ModbusProgram sut(plant, plant.write(text + "rewrite_ms = 0\n"));
  ASSERT_TRUE(eventually([&] {
    plant.put_out(0, 99);
    return output == 99 && quality_is(plant, 40, Quality::good);
  })) << sut.log();
  ends = true;
  EXPECT_EQ(sut.end(SIGTERM), 0);
  EXPECT_TRUE(eventually([&] { return output == 0 && zeros >= 2; })) << sut.log();
  EXPECT_FALSE(sut.logged("were not set to zero")) << sut.log();
}

// The device has carried out what it confirmed with noise. Meanwhile the PLC says its earlier value again.
TEST(ModbusNoise, AValueThatChangesWhileItsResponseIsGarbledIsWritten) {
  Plant plant;
  const SerialLine line;
  std::mutex plc;
  std::atomic<int> output{0};
  std::atomic<bool> was_garbled{false};
  const auto put_out = [&](std::uint16_t value) {
    const std::lock_guard lock(plc);
    plant.put_out(0, value);
  };
  const ScriptedLine device(line, [&](const Bytes& request) {
    Bytes frame = ScriptedLine::response(request, 11);
    if (request[1] == 16) output = request[8];
    if (request[1] == 16 && request[8] == 99 && !was_garbled) {
      put_out(5);
      frame[3] ^= 0x10U;
      was_garbled = true;
    }
    ScriptedLine::send(line, frame);
  });
  std::string text = serial_device(line, 1, 0);
  text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 10000\nsilent_after_ms = 600000");
  const ModbusProgram sut(plant, plant.write(text + "rewrite_ms = 0\n"));
  ASSERT_TRUE(eventually([&] {
    put_out(5);
    return output == 5 && quality_is(plant, 40, Quality::good);
  })) << sut.log();
  put_out(99);
  ASSERT_TRUE(eventually([&] { return was_garbled.load(); })) << sut.log();
  EXPECT_TRUE(eventually([&] { return output == 5; })) << sut.log();
}

// It would cost the others of its line twice the time.
TEST(ModbusNoise, ALostDeviceIsAskedOnceInEachAttempt) {
  Plant plant;
  const SerialLine line;
  std::atomic<int> requests{0};
  const ScriptedLine device(line, [&](const Bytes& request) {
    ++requests;
    Bytes frame = ScriptedLine::response(request, 11);
    frame[3] ^= 0x10U;
    ScriptedLine::send(line, frame);
  });
  const ModbusProgram sut(plant, plant.write(reader(line, 1, 0)));
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::lost); })) << sut.log();
  const TimePoint begin = MonotonicClock::now();
  const int before = requests;
  ASSERT_TRUE(eventually([&] { return requests >= before + 4; })) << sut.log();
  EXPECT_LE(requests - before, (MonotonicClock::now() - begin) / 100ms + 1);  // reconnect_ms
}

// At 1200 bits a second 3.5 characters take 32 ms.
TEST(ModbusNoise, AFrameBeginsBehindASilenceOfTheLine) {
  constexpr auto kSilence = 32ms;
  Plant plant;
  const SerialLine line;
  std::atomic<int> requests{0};
  std::atomic<int> early{0};
  TimePoint sent;
  const ScriptedLine device(line, [&](const Bytes& request) {
    if (sent != TimePoint() && MonotonicClock::now() - sent < kSilence) ++early;
    ++requests;
    sent = MonotonicClock::now();
    ScriptedLine::send(line, ScriptedLine::response(request, 11));
  });
  std::string text = serial_device(line, 1, 0);
  text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 10000\nbaud = 1200");
  const ModbusProgram sut(plant, plant.write(text));
  ASSERT_TRUE(eventually([&] {
    plant.put_out(0, static_cast<std::uint16_t>(requests.load()));
    return requests >= 20;
  })) << sut.log();
  EXPECT_EQ(early, 0);
}

// It answers only reads of the two registers from 100 on.
TEST(ModbusNoise, ADeviceThatIgnoresOtherReadsNeedsNoProbes) {
  Plant plant;
  const SerialLine line;
  std::atomic<bool> is_there{true};
  const ScriptedLine device(line, [&](const Bytes& request) {
    if (!is_there || request[5] != 2) return;
    ScriptedLine::send(line, ScriptedLine::with_checksum({1, 4, 4, 0, 11, 0, 22}));
  });
  std::string text = reader(line, 1, 0) + "count = 2\n";
  {
    const ModbusProgram sut(plant, plant.write(text));
    EXPECT_TRUE(eventually([&] { return sut.logged("if it never answers that, set probe = false"); }))
        << sut.log();
    EXPECT_FALSE(quality_is(plant, 40, Quality::good));
  }
  text.replace(text.find("unit = 1"), 8, "unit = 1\nprobe = false");
  const ModbusProgram sut(plant, plant.write(text), "next.log");
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::good); })) << sut.log();
  is_there = false;
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::lost); })) << sut.log();
  is_there = true;
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 40, Quality::good); })) << sut.log();
  EXPECT_EQ(plant.input_word(2), 22);
}

}  // namespace
}  // namespace plchost::testing
