// A program in a real instance, beside a real plchost-modbus that is killed, and its clients.

#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <modbus/modbus.h>

#include "instances/io/modbus/config/modbus_config.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/plc_process_image.h"
#include "tests/integration/instances/instance_process.hpp"
#include "tests/integration/modbus/modbus_peer.hpp"
#include "tests/integration/modbus/modbus_program.hpp"

namespace plchost::testing {
namespace {

/// An instance with these settings, and a plchost-modbus of the same pool.
class ModbusChain : public ::testing::Test {
 protected:
  ~ModbusChain() override {
    modbus.reset();
    instance.reset();
    remove_pool_memories(sandbox.pool());
  }
  void start(const std::string& program, const std::string& settings) {
    instance.emplace(sandbox, std::vector<std::string>{"--settings", sandbox.write("line1.cfg", settings),
                                                       "--application", application(program),
                                                       "--state-directory", sandbox.folder() + "/state"});
    instance->wait_until_up();
  }
  void start_modbus(const std::string& text) {
    const std::string file =
        sandbox.write("modbus.toml", fmt::format("[modbus]\npool = \"{}\"\n{}", sandbox.pool(), text));
    modbus.emplace(sandbox.folder() + "/modbus.log", file);
  }

  Sandbox sandbox;
  std::optional<InstanceProcess> instance;
  std::optional<ModbusProgram> modbus;
};

/// The quality of a terminal is %IW1 of a program that puts it out twofold as %QW1. %QX0.1 is %IX0.0, an
/// input of the terminal.
class KilledFirmware : public ModbusChain {
 protected:
  static constexpr std::uint32_t kSize = 16;
  ~KilledFirmware() override { plc_image_close(&outputs_); }
  void start_chain(std::string_view when_gone) {
    start("located",
          "[SysMem]\nLinux.Area.0.Flags=0x4\nLinux.Area.0.Object=t.in\nLinux.Area.0.Size=16\n"
          "Linux.Area.1.Flags=0x8\nLinux.Area.1.Object=t.out\nLinux.Area.1.Size=16\n");
    ASSERT_EQ(plc_image_open(sandbox.pool().c_str(), "t.out", kSize, PLC_IMAGE_READ, &outputs_), 0);
    peer.with([](modbus_mapping_t& mapping) { mapping.tab_input_bits[0] = 1; });
    text_ = fmt::format(R"(
[[image]]
name = "t.in"
direction = "input"
size = 16
[[device]]
name = "terminal"
tcp = "{}"
poll_ms = 10
when_gone = "{}"
status_image = "t.in"
status_offset = 2
[[device.read]]
kind = "discrete_input"
address = 0
image = "t.in"
)",
                        port.address(), when_gone);
    start_modbus(text_);
  }
  void start_again() { start_modbus(text_); }
  /// The program sees this quality, and this input.
  [[nodiscard]] bool sees(modbus::Quality quality, bool input) {
    std::array<std::uint8_t, kSize> bytes{};
    const auto is_seen = [&] {
      std::uint16_t twice = 0;
      if (plc_image_read(&outputs_, bytes.data(), nullptr) != PLC_IMAGE_OK) return false;
      std::memcpy(&twice, &bytes[2], sizeof twice);
      return twice == 2 * static_cast<unsigned>(quality) && ((bytes[0] & 2U) != 0) == input;
    };
    return eventually(is_seen);
  }

  const HeldPort port;
  ModbusPeer peer{port};

 private:
  std::string text_;
  plc_image outputs_{};
};

TEST_F(KilledFirmware, HasNoGoodQualityAnyMoreInAProgram) {
  ASSERT_NO_FATAL_FAILURE(start_chain("keep"));
  ASSERT_TRUE(sees(modbus::Quality::good, true)) << modbus->log();
  for (int round = 0; round < 3; ++round) {
    EXPECT_EQ(modbus->end(SIGKILL), -SIGKILL);
    const auto begin = MonotonicClock::now();
    EXPECT_TRUE(sees(modbus::Quality::none, true)) << instance->log();
    RecordProperty("ms", static_cast<int>((MonotonicClock::now() - begin) / std::chrono::milliseconds(1)));
    start_again();
    EXPECT_TRUE(sees(modbus::Quality::good, true)) << modbus->log();
  }
  EXPECT_THAT(instance->log(), ::testing::HasSubstr("has ended or stands still"));
}

TEST_F(KilledFirmware, HasZerosWhereItsConfigurationSaysSo) {
  ASSERT_NO_FATAL_FAILURE(start_chain("zero"));
  ASSERT_TRUE(sees(modbus::Quality::good, true)) << modbus->log();
  EXPECT_EQ(modbus->end(SIGKILL), -SIGKILL);
  EXPECT_TRUE(sees(modbus::Quality::none, false)) << instance->log();
  start_again();
  EXPECT_TRUE(sees(modbus::Quality::good, true)) << modbus->log();
}

TEST_F(KilledFirmware, ThatOnlyStandsStillComesBackByItself) {
  ASSERT_NO_FATAL_FAILURE(start_chain("keep"));
  ASSERT_TRUE(sees(modbus::Quality::good, true)) << modbus->log();
  ::kill(modbus->pid(), SIGSTOP);
  EXPECT_TRUE(sees(modbus::Quality::none, true)) << instance->log();
  ::kill(modbus->pid(), SIGCONT);
  EXPECT_TRUE(sees(modbus::Quality::good, true)) << modbus->log();
}

// The next instance looks before its first cycle.
TEST_F(KilledFirmware, IsNotGoodAgainForTheNextInstance) {
  ASSERT_NO_FATAL_FAILURE(start_chain("keep"));
  ASSERT_TRUE(sees(modbus::Quality::good, true)) << modbus->log();
  instance->end(SIGKILL);
  EXPECT_EQ(modbus->end(SIGKILL), -SIGKILL);
  std::this_thread::sleep_for(std::chrono::nanoseconds(PLC_IMAGE_PATIENCE_NS + PLC_IMAGE_SIGN_NS));
  plc_image inputs{};
  ASSERT_EQ(plc_image_open(sandbox.pool().c_str(), "t.in", kSize, PLC_IMAGE_READ, &inputs), 0);
  EXPECT_EQ(plc_image_state(&inputs), PLC_IMAGE_STATE_RUNNING) << "nobody has looked";
  instance.reset();
  start("located", "[SysMem]\nLinux.Area.0.Flags=0x4\nLinux.Area.0.Object=t.in\nLinux.Area.0.Size=16\n");
  EXPECT_EQ(plc_image_state(&inputs), PLC_IMAGE_STATE_SILENT);
  std::array<std::uint8_t, kSize> bytes{};
  EXPECT_EQ(plc_image_read(&inputs, bytes.data(), nullptr), PLC_IMAGE_OK);
  EXPECT_EQ(bytes[2], 0) << "the quality";
  plc_image_close(&inputs);
}

/// A program with a memory area, and a client that writes it over Modbus.
class SetPoints : public ModbusChain {
 protected:
  ~SetPoints() override {
    if (client_ == nullptr) return;
    modbus_close(client_);
    modbus_free(client_);
  }
  void start_chain() {
    start("set_points",
          "[SysMem]\nLinux.Area.0.Flags=0x10\nLinux.Area.0.Object=line1.m\nLinux.Area.0.Size=24\n");
    start_modbus(fmt::format(R"(
[[image]]
name = "line1.m"
direction = "memory"
size = 24
[server]
listen = "{}"
[[server.map]]
kind = "holding_register"
address = 0
count = 4
image = "line1.m"
writable = true
[[server.map]]
kind = "coil"
address = 0
count = 8
image = "line1.m"
offset = 8
writable = true
[[server.map]]
kind = "holding_register"
address = 5
image = "line1.m"
offset = 10
[[server.map]]
kind = "holding_register"
address = 6
count = 2
image = "line1.m"
offset = 12
order = "abcd"
writable = true
[[server.map]]
kind = "holding_register"
address = 8
count = 4
image = "line1.m"
offset = 16
writable = true
)",
                             port_.address()));
    client_ = modbus_new_tcp("127.0.0.1", port_.number());
    modbus_set_response_timeout(client_, 10, 0);
    ASSERT_TRUE(eventually([&] { return modbus_connect(client_) == 0; })) << modbus->log();
  }
  [[nodiscard]] int holding(int address) const {
    std::uint16_t value = 0;
    return modbus_read_registers(client_, address, 1, &value) == 1 ? int{value} : -1;
  }
  [[nodiscard]] int coil(int address) const {
    std::uint8_t value = 0;
    return modbus_read_bits(client_, address, 1, &value) == 1 ? int{value} : -1;
  }
  [[nodiscard]] bool write(int address, std::uint16_t value) const {
    return modbus_write_register(client_, address, value) == 1;
  }
  [[nodiscard]] bool write_coil(int address, bool on) const {
    return modbus_write_bit(client_, address, on) == 1;
  }
  [[nodiscard]] bool write_wide(std::uint16_t both) const {
    const std::array<std::uint16_t, 2> wide = {both, both};
    return modbus_write_registers(client_, 6, 2, wide.data()) == 2;
  }

 private:
  const HeldPort port_;
  modbus_t* client_ = nullptr;
};

// While the program writes in each cycle of 1 ms beside it.
TEST_F(SetPoints, OfAClientAreTakenAndNothingIsLost) {
  ASSERT_NO_FATAL_FAILURE(start_chain());
  const int before = holding(1);
  for (std::uint16_t value = 1; value <= 500; ++value) {
    ASSERT_TRUE(write(0, value));
    ASSERT_TRUE(write_wide(value));
    ASSERT_TRUE(write_coil(1, value % 2 != 0));
    ASSERT_EQ(holding(0), value);
  }
  EXPECT_TRUE(eventually([&] { return holding(2) == 500 && coil(2) == 0; }))
      << "as the program has seen them";
  EXPECT_TRUE(write_coil(1, true));
  EXPECT_TRUE(eventually([&] { return coil(2) == 1; }));
  EXPECT_NE(holding(1), before) << "the program runs";
  EXPECT_EQ(holding(3), 0) << "lost writes of the program";
  EXPECT_EQ(holding(5), 0) << "halves of values of 32 bit";
  EXPECT_FALSE(write(5, 1)) << "that map is only shown";
  // A value that the program changes in each cycle is the program's soon.
  EXPECT_TRUE(write(2, 7));
  EXPECT_TRUE(eventually([&] { return holding(2) == 500; }));
}

// A task that uses the place, too, comes between the assignment and the end of that cycle.
TEST_F(SetPoints, OfAClientDoNotUndoWhatATaskHasAssignedInItsCycle) {
  ASSERT_NO_FATAL_FAILURE(start_chain());
  for (std::uint16_t value = 30000; value < 30500; ++value) ASSERT_TRUE(write(8, value));
  const int after = holding(8);
  EXPECT_TRUE(eventually([&] { return holding(8) != after && holding(8) < 30000; }))
      << "the slow task assigns";
  EXPECT_EQ(holding(9), 0) << "assignments that were gone";
}

// Of a task that has not run since: the new version takes it, although it is the initial value.
TEST_F(SetPoints, OfAClientAreThereAfterAnOnlineChange) {
  ASSERT_NO_FATAL_FAILURE(start_chain());
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(write(10, 7));
    ASSERT_TRUE(eventually([&] { return holding(11) == 7; }));
    ASSERT_TRUE(write(10, 0));
    const ControlReply changed = instance->ask(ControlVerb::change_application, application("set_points_2"));
    ASSERT_EQ(changed.code, ErrorCode::ok) << changed.text;
    EXPECT_TRUE(eventually([&] { return holding(11) == 0; })) << "round " << round;
    EXPECT_EQ(holding(10), 0);
    if (round < 2) {
      ASSERT_EQ(instance->ask(ControlVerb::change_application, application("set_points")).code,
                ErrorCode::ok);
    }
  }
}

}  // namespace
}  // namespace plchost::testing
