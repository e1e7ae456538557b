// Devices on TCP behind gateways, and devices that have only part of Modbus.

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <string>
#include <string_view>
#include <thread>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <modbus/modbus.h>
#include <poll.h>
#include <sys/socket.h>

#include "tests/integration/modbus/device_of_a_test.hpp"
#include "tests/integration/modbus/modbus_peer.hpp"
#include "tests/integration/modbus/modbus_program.hpp"

namespace plchost::testing {
namespace {

using modbus::Quality;
using Mode = ModbusPeer::Mode;
using namespace std::chrono_literals;

// It was switched off meanwhile, as the gateway has told, and gets its outputs again.
TEST(ModbusGateway, ADeviceThatItDoesNotReachIsLost) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port);
  const ModbusProgram sut(plant, plant.write(device(port) + "rewrite_ms = 0\n"));
  ASSERT_TRUE(follows(plant, peer, 99)) << sut.log();
  peer.set(Mode::unreachable);
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::lost); })) << sut.log();
  EXPECT_EQ(plant.status(56).exception, 11);
  EXPECT_TRUE(eventually(
      [&] { return sut.logged("is lost: its gateway answers with exception 11: Target device failed"); }));
  const TimePoint begin = MonotonicClock::now();
  const int before = peer.requests();
  ASSERT_TRUE(eventually([&] { return peer.requests() >= before + 4; }));
  EXPECT_LE(peer.requests() - before, (MonotonicClock::now() - begin) / 100ms + 1) << "it backs off";
  peer.with([](modbus_mapping_t& mapping) { mapping.tab_registers[7] = 0; });
  peer.set(Mode::normal);
  EXPECT_TRUE(follows(plant, peer, 99)) << "unchanged, on the same connection";
  EXPECT_TRUE(eventually([&] { return plant.status(56).exception == 0; }));
}

/// A gateway with one connection at a time, as the plain loop of libmodbus is. Its units have their number in
/// input register 100, and the holding registers in common.
class NarrowGateway {
 public:
  static constexpr int kDeaf = 3;  ///< the unit that does not answer
  explicit NarrowGateway(const HeldPort& port)
      : context_(modbus_new_tcp("127.0.0.1", port.number())), mapping_(modbus_mapping_new(0, 0, 200, 200)) {
    listener_ = UniqueFd(modbus_tcp_listen(context_, 8));
    EXPECT_TRUE(listener_);
    thread_ = std::thread([this] { run(); });
  }
  ~NarrowGateway() {
    ends_ = true;
    thread_.join();
    modbus_mapping_free(mapping_);
    modbus_free(context_);
  }
  NarrowGateway(const NarrowGateway&) = delete;
  NarrowGateway& operator=(const NarrowGateway&) = delete;

  [[nodiscard]] int holding(int address) const { return holding_.at(static_cast<std::size_t>(address)); }
  void measure(std::uint16_t value) { measured_ = value; }

 private:
  void run() {
    UniqueFd client;
    while (!ends_) {
      pollfd look{.fd = client ? client.get() : listener_.get(), .events = POLLIN, .revents = 0};
      if (::poll(&look, 1, 10) <= 0) continue;
      if (!client) {
        client = UniqueFd(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
      } else if (!serve(client.get())) {
        client.reset();
      }
    }
  }
  bool serve(int client) {
    modbus_set_socket(context_, client);
    std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> request{};
    const int size = modbus_receive(context_, request.data());
    if (size < 0) return false;
    if (request[6] == kDeaf) return true;
    mapping_->tab_input_registers[100] = static_cast<std::uint16_t>(measured_ + request[6]);
    const bool replied = modbus_reply(context_, request.data(), size, mapping_) >= 0;
    for (std::size_t i = 0; i < holding_.size(); ++i) holding_.at(i) = mapping_->tab_registers[i];
    return replied;
  }

  modbus_t* context_;
  modbus_mapping_t* mapping_;
  UniqueFd listener_;
  std::array<std::atomic<int>, 4> holding_{};
  std::atomic<std::uint16_t> measured_{0};
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

// A device with unit_maps() of one output.
std::string unit_at(const HeldPort& port, int unit, int offset, int timeout_ms, std::string_view more = "") {
  return fmt::format(R"(
[[device]]
name = "unit{1}"
tcp = "{0}"
unit = {1}
poll_ms = 10
timeout_ms = {3}
reconnect_ms = 100
reconnect_max_ms = 1000
{2})",
                     port.address(), unit, more, timeout_ms) +
         unit_maps(unit, offset, 1);
}

TEST(ModbusGateway, UnitsOfOneAddressShareAConnection) {
  Plant plant;
  const HeldPort port;
  NarrowGateway gateway(port);
  ModbusProgram sut(plant, plant.write(unit_at(port, 1, 0, 10'000) + unit_at(port, 2, 8, 10'000)));
  ASSERT_TRUE(eventually([&] {
    plant.put_out(0, 7);
    return quality_is(plant, 40, Quality::good) && quality_is(plant, 48, Quality::good) &&
           gateway.holding(1) == 7 && gateway.holding(2) == 7;
  })) << sut.log();
  EXPECT_EQ(plant.input_word(0), 1);
  EXPECT_EQ(plant.input_word(8), 2);
  EXPECT_FALSE(sut.logged("is lost")) << sut.log();
  EXPECT_EQ(sut.end(SIGTERM), 0);
  EXPECT_TRUE(eventually([&] { return gateway.holding(1) == 0 && gateway.holding(2) == 0; })) << sut.log();
}

TEST(ModbusGateway, AUnitThatIsNotThereLeavesTheConnectionToTheOthers) {
  Plant plant;
  const HeldPort port;
  NarrowGateway gateway(port);
  const ModbusProgram sut(
      plant, plant.write(unit_at(port, 1, 0, 10'000) + unit_at(port, NarrowGateway::kDeaf, 8, 200)));
  ASSERT_TRUE(eventually([&] { return quality_is(plant, 48, Quality::lost); })) << sut.log();
  for (std::uint16_t value = 1; value <= 10; ++value) {
    gateway.measure(value);
    ASSERT_TRUE(eventually([&] { return plant.input_word(0) == value + 1; })) << sut.log();
  }
}

TEST(ModbusGateway, AUnitMayHaveAConnectionOfItsOwn) {
  Plant plant;
  const HeldPort port;
  const NarrowGateway gateway(port);
  const std::string own = "share_connection = false";
  const ModbusProgram sut(plant, plant.write(unit_at(port, 1, 0, 200, own) + unit_at(port, 2, 8, 200, own)));
  EXPECT_TRUE(eventually([&] {
    return quality_is(plant, 40, Quality::lost) || quality_is(plant, 48, Quality::lost);
  })) << sut.log();
}

// It is late, or a copy: its number says that it is none of this request.
TEST(ModbusGateway, AResponseToAnotherRequestIsPassedOver) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port, Mode::answers_another);
  measure(peer, 5);
  std::string text = device(port);
  text.replace(text.find("timeout_ms = 200"), 16, "timeout_ms = 10000");
  const ModbusProgram sut(plant, plant.write(text));
  ASSERT_TRUE(follows(plant, peer, 99)) << sut.log();
  EXPECT_TRUE(eventually([&] { return quality_is(plant, 56, Quality::good) && plant.input_word(0) == 5; }));
  EXPECT_FALSE(sut.logged("is lost")) << sut.log();
}

TEST(ModbusGateway, TheFunctionOfAWriteCanBeChosen) {
  struct Choice {
    Mode mode;
    std::string_view count;
    std::string_view function;
  };
  for (const auto& [mode, count, function] :
       {Choice{Mode::no_single, "", "function = \"several\"\n"},
        Choice{Mode::no_several, "count = 2\n", "function = \"single\"\n"}}) {
    Plant plant;
    const HeldPort port;
    ModbusPeer peer(port, mode);
    std::string text = device(port);
    text.replace(text.find("count = 2\n"), 10, count);
    {
      const ModbusProgram sut(plant, plant.write(text));
      EXPECT_TRUE(eventually([&] {
        plant.put_out(0, 99);
        return sut.logged("refuses a request with exception 1: Illegal function");
      })) << sut.log();
    }
    text += function;
    text += "[[device.write]]\nkind = \"coil\"\naddress = 30\nimage = \"t.out\"\noffset = 8\n";
    text += count;
    text += function;
    ModbusProgram sut(plant, plant.write(text), "next.log");
    EXPECT_TRUE(follows(plant, peer, 99)) << sut.log();
    if (!count.empty()) {
      EXPECT_TRUE(eventually([&] {
        plant.put_out(2, 98);
        return peer.holding(8) == 98;
      })) << sut.log();
    }
    EXPECT_TRUE(eventually([&] {
      plant.put_out(8, 3);
      return peer.coil(30) == 1 && peer.coil(31) == (count.empty() ? 0 : 1);
    })) << sut.log();
    EXPECT_EQ(sut.end(SIGTERM), 0);
    EXPECT_TRUE(eventually([&] { return peer.coil(30) == 0; })) << sut.log();
  }
}

// The last ones come 1.4 s behind the first one, and the PLC has changed its mind meanwhile.
TEST(ModbusGateway, CoilsThatAreWrittenOneByOneAreNotOld) {
  Plant plant;
  const HeldPort port;
  ModbusPeer peer(port, Mode::slow);
  std::string text = device(port, "silent_after_ms = 600000");
  text.resize(text.find("[[device.read]]"));
  text += "[[device.write]]\nkind = \"coil\"\naddress = 0\ncount = 64\nimage = \"t.out\"\n";
  text += "function = \"single\"\nrewrite_ms = 0\n";
  plant.put_out(6, 0xffff);  // coils 48 to 63
  const ModbusProgram sut(plant, plant.write(text));
  ASSERT_TRUE(eventually([&] { return peer.requests() >= 1; })) << sut.log();
  plant.put_out(6, 0);
  bool was_on = false;
  ASSERT_TRUE(eventually([&] {
    was_on = was_on || peer.coil(48) == 1;
    return peer.requests() >= 64;
  })) << sut.log();
  EXPECT_FALSE(was_on);
  EXPECT_EQ(peer.coil(62), 0);
}

// Of the map at 200 the device knows nothing any more.
TEST(ModbusGateway, ADeviceMayRefuseAnOptionalMap) {
  for (const std::string_view when_gone : {"keep", "zero"}) {
    Plant plant;
    const HeldPort port;
    ModbusPeer peer(port);
    measure(peer, 5);
    peer.with([](modbus_mapping_t& mapping) { mapping.tab_input_registers[ModbusPeer::kHalf] = 7; });
    std::string text = device(port, fmt::format("when_gone = \"{}\"", when_gone));
    text.insert(text.find("[[device.read]]"),
                fmt::format("[[device.read]]\nkind = \"input_register\"\naddress = {}\n"
                            "image = \"t.in\"\noffset = 4\noptional = true\n",
                            ModbusPeer::kHalf));
    const ModbusProgram sut(plant, plant.write(text));
    ASSERT_TRUE(eventually([&] { return plant.input_word(0) == 5 && plant.input_word(4) == 7; }))
        << sut.log();
    EXPECT_EQ(plant.status(56).exception, 0);
    peer.set(Mode::half);
    EXPECT_TRUE(eventually([&] { return plant.status(56).exception == 1; })) << sut.log();
    measure(peer, 6);
    EXPECT_TRUE(eventually([&] { return plant.input_word(0) == 6; }));
    EXPECT_EQ(plant.input_word(4), when_gone == "keep" ? 7 : 0);
    EXPECT_TRUE(quality_is(plant, 56, Quality::good));
    EXPECT_TRUE(eventually([&] {
      return sut.logged("refuses the optional map from address 200 with exception 1");
    })) << sut.log();
    peer.set(Mode::normal);
    EXPECT_TRUE(eventually([&] { return plant.status(56).exception == 0 && plant.input_word(4) == 7; }));
  }
}

}  // namespace
}  // namespace plchost::testing
