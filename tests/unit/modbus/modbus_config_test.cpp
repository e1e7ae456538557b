#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "instances/io/modbus/config/load_modbus.hpp"
#include "instances/io/modbus/config/modbus_keys.hpp"
#include "tests/unit/modbus/parsed_text.hpp"

namespace plchost::modbus {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using namespace std::chrono_literals;

// Line 9 is the first one.
constexpr std::string_view kDevice = R"([[device]]
name = "valves"
tcp = "127.0.0.1:1502"
)";
constexpr std::string_view kRead = R"([[device.read]]
kind = "holding_register"
address = 0
image = "t.in"
)";

TEST(ModbusConfig, ReadsAllOfADevice) {
  const auto config = parse(R"([modbus]
pool = "p"
[[device]]
name = "drive"
serial = "/dev/ttyUSB0"
baud = 9600
parity = "none"
stop_bits = 2
unit = 17
probe = false
poll_ms = 20
timeout_ms = 100
reconnect_ms = 200
reconnect_max_ms = 400
when_gone = "zero"
gone_after_ms = 300
when_silent = "keep"
silent_after_ms = 50
status_image = "t.in"
status_offset = 56
[[device.read]]
kind = "input_register"
address = 100
count = 4
image = "t.in"
offset = 8
order = "cdab"
optional = true
[[device.write]]
kind = "coil"
address = 3
count = 5
image = "t.out"
offset = 2
bit = 7
function = "single"
rewrite_ms = 0
[server]
listen = "[::1]:1502"
[[server.map]]
kind = "holding_register"
address = 0
count = 4
image = "t.in"
offset = 40
writable = true
)");
  ASSERT_TRUE(config.has_value()) << config.error().front();
  EXPECT_EQ(config->process.pool, "p");
  ASSERT_THAT(config->devices, SizeIs(1));
  const DeviceConfig& device = config->devices[0];
  EXPECT_EQ(device.serial, "/dev/ttyUSB0");
  EXPECT_EQ(device.baud, 9600);
  EXPECT_EQ(device.parity, Parity::none);
  EXPECT_EQ(device.stop_bits, 2);
  EXPECT_EQ(device.unit, 17);
  EXPECT_FALSE(device.probe);
  EXPECT_EQ(device.poll, 20ms);
  EXPECT_EQ(device.timeout, 100ms);
  EXPECT_EQ(device.reconnect, 200ms);
  EXPECT_EQ(device.reconnect_max, 400ms);
  EXPECT_EQ(device.when_gone, LossPolicy::zero);
  EXPECT_EQ(device.gone_after, 300ms);
  EXPECT_EQ(device.when_silent, LossPolicy::keep);
  EXPECT_EQ(device.silent_after, 50ms);
  EXPECT_EQ(device.status_offset, 56);
  ASSERT_THAT(device.reads, SizeIs(1));
  EXPECT_EQ(device.reads[0].kind, RegisterKind::input_register);
  EXPECT_EQ(device.reads[0].address, 100);
  EXPECT_EQ(device.reads[0].count, 4);
  EXPECT_EQ(device.reads[0].offset, 8);
  EXPECT_EQ(device.reads[0].order, RegisterOrder::cdab);
  EXPECT_TRUE(device.reads[0].optional);
  ASSERT_THAT(device.writes, SizeIs(1));
  EXPECT_EQ(device.writes[0].bit, 7);
  EXPECT_EQ(device.writes[0].function, WriteFunction::single);
  EXPECT_EQ(device.writes[0].rewrite, 0ms);
  ASSERT_TRUE(config->server.has_value());
  ASSERT_THAT(config->server->maps, SizeIs(1));
  EXPECT_TRUE(config->server->maps[0].writable);
}

TEST(ModbusConfig, LetsClientsWriteInputsAndMemoryAreas) {
  const std::string memory = "[[image]]\nname = \"line1\"\ndirection = \"memory\"\nsize = 8\n";
  for (const char* image : {"t.in", "line1"}) {
    EXPECT_EQ(refused(memory +
                      "[server]\n[[server.map]]\nkind = \"coil\"\naddress = 0\nwritable = true\nimage = \"" +
                      image + "\"\n"),
              "accepted");
  }
}

TEST(ModbusConfig, TellsAllErrorsWithLineAndKey) {
  const auto config = parse(R"([[device]]
name = "valves"
tcp = "plc.example:502"
poll_ms = 0
[[device.read]]
kind = "coils"
address = 0
image = "t.inn"
)");
  ASSERT_FALSE(config.has_value());
  EXPECT_THAT(
      config.error(),
      ElementsAre(HasSubstr("m.toml:11:1: [[device]] 'valves' tcp: \"plc.example:502\" is no address"),
                  HasSubstr("m.toml:12:1: [[device]] 'valves' poll_ms: 0 is out of range; allowed is 1 to"),
                  AllOf(HasSubstr("m.toml:14:1: [[device]] 'valves' [[device.read]] number 1 kind"),
                        HasSubstr("did you mean 'coil'?")),
                  AllOf(HasSubstr("m.toml:16:1:"), HasSubstr("there is no [[image]] 't.inn'"),
                        HasSubstr("did you mean 't.in'?"))));
}

TEST(ModbusConfig, NamesBothLinesOfAnOverlap) {
  const std::string device(kDevice);
  // Registers of 2 bytes at byte 0, and a bit in them.
  EXPECT_THAT(
      refused(device + std::string(kRead) +
              "[[device.read]]\nkind = \"coil\"\naddress = 9\nimage = \"t.in\"\noffset = 1\nbit = 7\n"),
      HasSubstr("m.toml:16: offset: overlaps with line 12: both have image 't.in' bits 15 to 15"));
  // The status and a map.
  EXPECT_THAT(refused(device + "status_image = \"t.in\"\nstatus_offset = 0\n" + std::string(kRead)),
              HasSubstr("m.toml:14: offset: overlaps with line 9: both have image 't.in' bits 0 to 15"));
  // Two maps write one coil of a device.
  const std::string write = "[[device.write]]\nkind = \"coil\"\naddress = 4\ncount = 4\nimage = \"t.out\"\n";
  EXPECT_THAT(
      refused(device + write + write),
      HasSubstr(
          "m.toml:17: address: overlaps with line 12: both have coil of device 'valves' addresses 4 to 7"));
  // A client of the server and a device write one place.
  const std::string served = "kind = \"holding_register\"\naddress = 0\nimage = \"t.in\"\n";
  EXPECT_THAT(
      refused(device + std::string(kRead) + "[server]\n[[server.map]]\n" + served + "writable = true\n"),
      HasSubstr("overlaps with line 12"));
  EXPECT_EQ(refused(device + std::string(kRead) + "[server]\n[[server.map]]\n" + served), "accepted");
  // Two maps show one register.
  EXPECT_THAT(refused("[server]\n[[server.map]]\n" + served + "[[server.map]]\n" + served + "offset = 2\n"),
              HasSubstr("overlaps with line 10: both have holding_register addresses 0 to 0"));
}

TEST(ModbusConfig, AWideMapHidesNoOverlapBehindAShortOne) {
  const std::string device(kDevice);
  const auto read = [](int offset, int count) {
    return fmt::format(
        "[[device.read]]\nkind = \"holding_register\"\naddress = 0\nimage = \"t.in\"\n"
        "offset = {}\ncount = {}\n",
        offset, count);
  };
  const auto config = parse(device + read(0, 20) + read(2, 1) + read(30, 1));
  ASSERT_FALSE(config.has_value());
  EXPECT_THAT(config.error(), SizeIs(2));
}

TEST(ModbusConfig, RefusesTheSameDeviceOrNameTwice) {
  const std::string device = std::string(kDevice) + std::string(kRead);
  const std::string other =
      "[[device]]\nname = \"other\"\ntcp = \"127.0.0.1:1502\"\n[[device.read]]\n"
      "kind = \"coil\"\naddress = 0\nimage = \"t.in\"\noffset = 4\n";
  EXPECT_THAT(refused(device + other),
              HasSubstr("[[device]] 'other' unit: 127.0.0.1:1502 unit 1 is the device of line 9"));
  EXPECT_THAT(refused(std::string(kImages)), HasSubstr("name: is taken already in line 1"));
}

TEST(ModbusConfig, KnowsADeviceByEachSpellingOfItsAddress) {
  const auto device = [](std::string_view name, std::string_view way, int offset) {
    return fmt::format(
        "[[device]]\nname = \"{}\"\n{}\n[[device.read]]\n"
        "kind = \"coil\"\naddress = 0\nimage = \"t.in\"\noffset = {}\n",
        name, way, offset);
  };
  for (const auto& [one, other] : std::vector<std::pair<const char*, const char*>>{
           {"tcp = \"127.0.0.1\"", "tcp = \"127.0.0.1:502\""},
           {"tcp = \"[::1]:502\"", "tcp = \"[0:0::1]\""},
           {"serial = \"/dev/ttyS9\"", "serial = \"/dev//./ttyS9\""}}) {
    EXPECT_THAT(refused(device("one", one, 0) + device("other", other, 4)),
                HasSubstr("unit 1 is the device of line 9"))
        << other;
  }
}

TEST(ModbusConfig, TheDevicesOfOneLineHaveOneSpeed) {
  const auto device = [](int unit, int baud, int offset) {
    return fmt::format(
        "[[device]]\nname = \"d{0}\"\nserial = \"/dev/ttyS9\"\nunit = {0}\nbaud = {1}\n"
        "[[device.read]]\nkind = \"coil\"\naddress = 0\nimage = \"t.in\"\noffset = {2}\n",
        unit, baud, offset);
  };
  EXPECT_EQ(refused(device(1, 9600, 0) + device(2, 9600, 1)), "accepted");
  EXPECT_THAT(refused(device(1, 9600, 0) + device(2, 19200, 1)), HasSubstr("has another baud"));
}

// 125 registers of 11 bits for each byte at 4800 baud: 585 ms.
TEST(ModbusConfig, AResponseThatTakesLongerThanItsLimitIsRefused) {
  const auto device = [](int baud, int timeout, int count) {
    return fmt::format(
        "[[image]]\nname = \"big.in\"\ndirection = \"input\"\nsize = 1000\n"
        "[[device]]\nname = \"d\"\nserial = \"/dev/ttyS9\"\nbaud = {}\ntimeout_ms = {}\n"
        "[[device.read]]\nkind = \"input_register\"\naddress = 0\nimage = \"big.in\"\ncount = {}\n",
        baud, timeout, count);
  };
  EXPECT_THAT(refused(device(4800, 500, 125)),
              HasSubstr("m.toml:17:1: [[device]] 'd' timeout_ms: the response of the map in line 18 alone "
                        "takes 585 ms at 4800 baud"));
  EXPECT_EQ(refused(device(4800, 600, 125)), "accepted");
  EXPECT_EQ(refused(device(4800, 500, 100)), "accepted");
  EXPECT_EQ(refused(device(9600, 500, 125)), "accepted");
}

TEST(ModbusConfig, HasBounds) {
  const auto devices = [](std::size_t count) {
    std::string text;
    for (std::size_t i = 0; i < count; ++i) {
      text += fmt::format(
          "[[device]]\nname = \"d{0}\"\ntcp = \"127.0.0.1:{1}\"\n[[device.read]]\n"
          "kind = \"coil\"\naddress = 0\nimage = \"t.in\"\noffset = {2}\nbit = {3}\n",
          i, 1000 + i, i / 8, i % 8);
    }
    return text;
  };
  EXPECT_EQ(refused(devices(kMaxDevices)), "accepted");
  EXPECT_THAT(refused(devices(kMaxDevices + 1)), HasSubstr("257 [[device]]; allowed are up to 256"));
  const auto maps = [](std::size_t count) {
    std::string text(kDevice);
    for (std::size_t i = 0; i < count; ++i) {
      text += fmt::format(
          "[[device.read]]\nkind = \"coil\"\naddress = 0\nimage = \"t.in\"\noffset = {}\nbit = {}\n", i / 8,
          i % 8);
    }
    return text;
  };
  EXPECT_EQ(refused(maps(kMaxMaps)), "accepted");
  EXPECT_THAT(refused(maps(kMaxMaps + 1)), HasSubstr("65 [[device.read]]; allowed are up to 64"));
  const auto images = [](std::size_t count) {
    std::string text;
    for (std::size_t i = 2; i < count; ++i) {
      text += fmt::format("[[image]]\nname = \"i{}\"\ndirection = \"input\"\nsize = 1\n", i);
    }
    return text + std::string(kDevice) + std::string(kRead);
  };
  EXPECT_EQ(refused(images(kMaxImages)), "accepted");
  EXPECT_THAT(refused(images(kMaxImages + 1)), HasSubstr("33 [[image]]; allowed are up to 32"));
}

TEST(ModbusConfig, TellsAHundredErrorsAtMost) {
  std::string text;
  for (int i = 0; i < 200; ++i) text += fmt::format("x{} = 1\n", i);
  const auto config = parse_modbus_config(text, "m.toml");
  ASSERT_FALSE(config.has_value());
  EXPECT_THAT(config.error(), SizeIs(100));
}

TEST(ModbusConfig, RefusesAFileThatIsNotThere) {
  const auto config = load_modbus_config("/nonexistent/m.toml");
  ASSERT_FALSE(config.has_value());
  EXPECT_THAT(config.error(), ElementsAre(HasSubstr("there is no file")));
}

// PLCHOST_WRITE_TABLES=1 writes the table into the page.
TEST(ModbusConfig, IsDescribedByTheTableInItsDocument) {
  constexpr std::string_view kBegin = "<!-- generated: modbus, by unit_modbus -->\n";
  constexpr std::string_view kEnd = "<!-- end of generated -->";
  const std::string table = modbus_key_table();
  std::stringstream stream;
  stream << std::ifstream(MODBUS_PAGE).rdbuf();
  std::string page = stream.str();
  const std::size_t begin = page.find(kBegin);
  ASSERT_NE(begin, std::string::npos) << MODBUS_PAGE " has no line " << kBegin;
  const std::size_t size = page.find(kEnd, begin) - begin - kBegin.size();
  ASSERT_LT(size, page.size()) << MODBUS_PAGE " has no line " << kEnd;
  if (std::getenv("PLCHOST_WRITE_TABLES") != nullptr) {
    std::ofstream(MODBUS_PAGE) << page.replace(begin + kBegin.size(), size, table);
    return;
  }
  EXPECT_EQ(page.substr(begin + kBegin.size(), size), table) << "write it: PLCHOST_WRITE_TABLES=1";
}

}  // namespace
}  // namespace plchost::modbus
