#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "instances/io/modbus/config/load_modbus.hpp"
#include "instances/io/modbus/config/modbus_keys.hpp"

namespace plchost::modbus {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using namespace std::chrono_literals;

// The lines of this text are counted in the tests.
constexpr std::string_view kImages = R"([[image]]
name = "t.in"
direction = "input"
size = 64
[[image]]
name = "t.out"
direction = "output"
size = 64
)";

std::expected<ModbusConfig, ConfigErrors> parse(std::string_view text) {
  return parse_modbus_config(std::string(kImages) + std::string(text), "m.toml");
}

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

std::string refused(std::string_view text) {
  const auto config = parse(text);
  if (config) return "accepted";
  return fmt::format("{}", fmt::join(config.error(), "\n"));
}

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
[[device.write]]
kind = "coil"
address = 3
count = 5
image = "t.out"
offset = 2
bit = 7
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
  ASSERT_THAT(device.writes, SizeIs(1));
  EXPECT_EQ(device.writes[0].bit, 7);
  EXPECT_EQ(device.writes[0].rewrite, 0ms);
  ASSERT_TRUE(config->server.has_value());
  ASSERT_THAT(config->server->maps, SizeIs(1));
  EXPECT_TRUE(config->server->maps[0].writable);
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

struct Refusal {
  const char* text;  ///< behind the images
  const char* error;
};
class RefusedModbusConfig : public ::testing::TestWithParam<Refusal> {};

TEST_P(RefusedModbusConfig, SaysWhatIsAllowed) {
  EXPECT_THAT(refused(GetParam().text), HasSubstr(GetParam().error));
}

#define DEVICE "[[device]]\nname = \"d\"\ntcp = \"127.0.0.1\"\n"
#define READ "[[device.read]]\naddress = 0\nimage = \"t.in\"\n"
#define WRITE "[[device.write]]\naddress = 0\nimage = \"t.out\"\n"
#define SERVER "[server]\nlisten = \"127.0.0.1:1502\"\n[[server.map]]\naddress = 0\n"
const Refusal kRefusals[] = {
    {"", "m.toml: has nothing to do; add a [[device]] or [server]"},
    {"[devices]\n", "m.toml:9:2: unknown section or key 'devices'"},
    {"[device]\nname = \"d\"\n", "'device' must be written [[device]]"},
    {"[[server]]\n", "'server' must be a section: [server]"},
    {"[[device]]\nname = \"d\"\ntcp = \"1.2.3.4\"\n", "the device has no map"},
    {"[[device]]\nname = \"d\"\n" READ "kind = \"coil\"\n", "tcp: is missing, and so is serial"},
    {DEVICE "serial = \"/dev/ttyS0\"\n" READ "kind = \"coil\"\n", "stands beside serial"},
    {DEVICE "baud = 9600\n" READ "kind = \"coil\"\n", "m.toml:12:1: [[device]] 'd' baud: is for serial"},
    {DEVICE "unit = 250\n" READ "kind = \"coil\"\n", "250 is reserved; allowed is 0 to 247, and 255"},
    {"[[device]]\nname = \"d\"\nserial = \"/dev/ttyS0\"\nunit = 0\n" READ "kind = \"coil\"\n",
     "0 is no address at a serial line; allowed is 1 to 247"},
    {"[[device]]\nname = \"d\"\nserial = \"/dev/ttyS0\"\nbaud = 1300\n" READ "kind = \"coil\"\n",
     "1300 is no speed; allowed are 1200, 2400"},
    {"[[device]]\nname = \"d\"\nserial = \"ttyS0\"\n" READ "kind = \"coil\"\n", "is no path"},
    {DEVICE "tcp_port = 502\n" READ "kind = \"coil\"\n", "unknown key 'tcp_port'"},
    {DEVICE "reconnect_ms = 500\nreconnect_max_ms = 400\n" READ "kind = \"coil\"\n", "is below reconnect_ms"},
    {DEVICE "status_offset = 4\n" READ "kind = \"coil\"\n", "status_offset: needs status_image"},
    {DEVICE "status_image = \"t.in\"\nstatus_offset = 57\n" READ "kind = \"coil\"\n",
     "the status has 8 bytes, and image 't.in' has 64"},
    {DEVICE "status_image = \"t.out\"\n" READ "kind = \"coil\"\n", "is an output image"},
    {DEVICE READ, "kind: is missing"},
    {DEVICE "[[device.read]]\nkind = \"coil\"\nimage = \"t.in\"\n",
     "address: is missing; allowed is 0 to 65535"},
    {DEVICE "[[device.read]]\nkind = \"coil\"\naddress = 0\n", "image: is missing"},
    {DEVICE READ "kind = \"coil\"\ncount = 2001\n", "allowed is 1 to 2000 of kind coil"},
    {DEVICE READ "kind = \"input_register\"\ncount = 126\n", "allowed is 1 to 125 of kind input_register"},
    {DEVICE WRITE "kind = \"holding_register\"\ncount = 124\n",
     "allowed is 1 to 123 of kind holding_register"},
    {DEVICE WRITE "kind = \"coil\"\ncount = 1969\n", "allowed is 1 to 1968 of kind coil"},
    {DEVICE WRITE "kind = \"input_register\"\n", "input_register can only be read"},
    {DEVICE WRITE "kind = \"coil\"\nwritable = true\n", "unknown key 'writable'"},
    {DEVICE READ "kind = \"coil\"\nrewrite_ms = 5\n", "unknown key 'rewrite_ms'"},
    {DEVICE "[[device.read]]\nkind = \"coil\"\naddress = 0\nimage = \"t.out\"\n",
     "'t.out' is an output image, which the PLC writes"},
    {DEVICE "[[device.write]]\nkind = \"coil\"\naddress = 0\nimage = \"t.in\"\n", "'t.in' is an input image"},
    {DEVICE READ "kind = \"holding_register\"\ncount = 33\n",
     "the map ends at byte 66, and image 't.in' has 64"},
    {DEVICE READ "kind = \"coil\"\noffset = 63\nbit = 4\ncount = 5\n", "the map ends at byte 65"},
    {DEVICE READ "kind = \"holding_register\"\nbit = 1\n", "is for bits, and kind is holding_register"},
    {DEVICE READ "kind = \"coil\"\norder = \"abcd\"\ncount = 2\n", "is for registers, and kind is coil"},
    {DEVICE READ "kind = \"holding_register\"\norder = \"abcd\"\ncount = 3\n", "allowed is an even count"},
    {DEVICE "[[device.read]]\nkind = \"coil\"\naddress = 65535\ncount = 2\nimage = \"t.in\"\n",
     "from address 65535 there are 1 more; 2 are asked for"},
    {SERVER "kind = \"coil\"\nimage = \"t.out\"\nwritable = true\n", "'t.out' is an output image"},
    {SERVER "kind = \"discrete_input\"\nimage = \"t.in\"\nwritable = true\n",
     "discrete_input can only be read"},
    {"[server]\nlisten = \"0.0.0.0:502\"\n[[server.map]]\naddress = 0\nkind = \"coil\"\nimage = \"t.in\"\n",
     "set allow_unsecured = true"},
    {"[server]\nlisten = \"127.0.0.1:1502\"\n", "the server shows nothing; add [[server.map]]"},
    {"[server]\nlisten = \"\"\n[[server.map]]\naddress = 0\nkind = \"coil\"\nimage = \"t.in\"\n",
     "\"\" is no address"},
    {"[server]\nconnections = 65\n[[server.map]]\naddress = 0\nkind = \"coil\"\nimage = \"t.in\"\n",
     "65 is out of range; allowed is 1 to 64"},
    {DEVICE "[[device.read]]\nkind = coil\n", "put texts in quotes"},
};
INSTANTIATE_TEST_SUITE_P(Each, RefusedModbusConfig, ::testing::ValuesIn(kRefusals));

TEST(ModbusConfig, NamesBothLinesOfAnOverlap) {
  const std::string device(kDevice);
  // Registers of 2 bytes at byte 0, and a bit in them.
  EXPECT_THAT(
      refused(device + std::string(kRead) +
              "[[device.read]]\nkind = \"coil\"\naddress = 9\nimage = \"t.in\"\noffset = 1\nbit = 7\n"),
      HasSubstr("m.toml:16: overlaps with line 12: both have image 't.in' bits 15 to 15"));
  // The status and a map.
  EXPECT_THAT(refused(device + "status_image = \"t.in\"\nstatus_offset = 0\n" + std::string(kRead)),
              HasSubstr("m.toml:14: overlaps with line 9: both have image 't.in' bits 0 to 15"));
  // Two maps write one coil of a device.
  const std::string write = "[[device.write]]\nkind = \"coil\"\naddress = 4\ncount = 4\nimage = \"t.out\"\n";
  EXPECT_THAT(
      refused(device + write + write),
      HasSubstr("m.toml:17: overlaps with line 12: both have coil of device 'valves' addresses 4 to 7"));
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
  EXPECT_THAT(refused(device + other), HasSubstr("127.0.0.1:1502 unit 1 is the device of line 9"));
  EXPECT_THAT(refused(std::string(kImages)), HasSubstr("name: is taken already in line 1"));
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
  EXPECT_THAT(refused(devices(kMaxDevices + 1)), HasSubstr("65 [[device]]; allowed are up to 64"));
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
