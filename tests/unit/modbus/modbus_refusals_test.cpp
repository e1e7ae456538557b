#include <string>

#include <gmock/gmock.h>

#include "tests/unit/modbus/parsed_text.hpp"

namespace plchost::modbus {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

struct Refusal {
  const char* text;  ///< behind the images
  const char* error;
};
class RefusedModbusConfig : public ::testing::TestWithParam<Refusal> {};

TEST_P(RefusedModbusConfig, SaysWhatIsAllowed) {
  EXPECT_THAT(refused(GetParam().text), HasSubstr(GetParam().error));
}

// A list in a list, 300 times.
const char* const kDeep = [] {
  static const std::string text = "a = " + std::string(300, '[') + std::string(300, ']') + "\n";
  return text.c_str();
}();

#define DEVICE "[[device]]\nname = \"d\"\ntcp = \"127.0.0.1\"\n"
#define READ "[[device.read]]\naddress = 0\nimage = \"t.in\"\n"
#define WRITE "[[device.write]]\naddress = 0\nimage = \"t.out\"\n"
#define MEMORY "[[image]]\nname = \"line1\"\ndirection = \"memory\"\nsize = 8\n"
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
    {DEVICE "probe = true\n" READ "kind = \"coil\"\n", "[[device]] 'd' probe: is for serial"},
    {"[[device]]\nname = \"d\"\nserial = \"/dev/ttyS0\"\nshare_connection = true\n" READ "kind = \"coil\"\n",
     "share_connection: is for tcp, and the device has serial"},
    {DEVICE READ "kind = \"coil\"\nfunction = \"single\"\n", "unknown key 'function'"},
    {DEVICE WRITE "kind = \"coil\"\nfunction = \"singel\"\n", "did you mean 'single'?"},
    {DEVICE WRITE "kind = \"coil\"\noptional = true\n", "unknown key 'optional'"},
    {DEVICE "unit = 250\n" READ "kind = \"coil\"\n", "250 is reserved; allowed is 0 to 247, and 255"},
    {"[[device]]\nname = \"d\"\nserial = \"/dev/ttyS0\"\nunit = 0\n" READ "kind = \"coil\"\n",
     "0 is no address at a serial line; allowed is 1 to 247"},
    {"[[device]]\nname = \"d\"\nserial = \"/dev/ttyS0\"\nbaud = 1300\n" READ "kind = \"coil\"\n",
     "1300 is no speed; allowed are 1200, 2400"},
    {"[[device]]\nname = \"d\"\nserial = \"ttyS0\"\n" READ "kind = \"coil\"\n", "is no path"},
    {DEVICE "tcp_port = 502\n" READ "kind = \"coil\"\n", "unknown key 'tcp_port'"},
    {DEVICE "reconnect_ms = 500\nreconnect_max_ms = 400\n" READ "kind = \"coil\"\n",
     "m.toml:13:1: [[device]] 'd' reconnect_max_ms: 400 is below reconnect_ms, which is 500; allowed is that "
     "or "
     "more"},
    {DEVICE "reconnect_ms = 20000\n" READ "kind = \"coil\"\n",
     "m.toml:12:1: [[device]] 'd' reconnect_ms: 20000 is above reconnect_max_ms, which is 10000 by default"},
    {DEVICE "poll_ms = 300\ngone_after_ms = 300\n" READ "kind = \"coil\"\n",
     "m.toml:13:1: [[device]] 'd' gone_after_ms: 300 is not above poll_ms, which is 300; allowed is more "
     "than"},
    {DEVICE "gone_after_ms = 100\n" READ "kind = \"coil\"\n",
     "m.toml:12:1: [[device]] 'd' gone_after_ms: 100 is not above poll_ms, which is 100 by default"},
    {DEVICE "when_gone = \"zero\"\npoll_ms = 1000\n" READ "kind = \"coil\"\n",
     "m.toml:13:1: [[device]] 'd' poll_ms: 1000 is not below gone_after_ms, which is 1000 by default"},
    {DEVICE "status_offset = 4\n" READ "kind = \"coil\"\n", "status_offset: needs status_image"},
    {DEVICE "status_image = \"t.in\"\nstatus_offset = 57\n" READ "kind = \"coil\"\n",
     "the status has 8 bytes, and image 't.in' has 64"},
    {DEVICE "status_image = \"t.out\"\n" READ "kind = \"coil\"\n", "is no input image"},
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
    {MEMORY DEVICE "[[device.read]]\nkind = \"coil\"\naddress = 0\nimage = \"line1\"\n",
     "'line1' is a memory area; allowed is an image with direction = \"input\""},
    {MEMORY DEVICE "[[device.write]]\nkind = \"coil\"\naddress = 0\nimage = \"line1\"\n",
     "'line1' is a memory area"},
    {MEMORY SERVER "kind = \"input_register\"\nimage = \"line1\"\nwritable = true\n",
     "input_register can only be read"},
    {DEVICE READ "kind = \"holding_register\"\ncount = 33\n",
     "the map ends at byte 66, and image 't.in' has 64"},
    {DEVICE READ "kind = \"coil\"\noffset = 63\nbit = 4\ncount = 5\n", "the map ends at byte 65"},
    {DEVICE READ "kind = \"holding_register\"\nbit = 1\n", "is for bits, and kind is holding_register"},
    {DEVICE READ "kind = \"coil\"\norder = \"abcd\"\ncount = 2\n", "is for registers, and kind is coil"},
    {DEVICE READ "kind = \"holding_register\"\norder = \"abcd\"\ncount = 3\n", "allowed is an even count"},
    {DEVICE "[[device.read]]\nkind = \"coil\"\naddress = 65535\ncount = 2\nimage = \"t.in\"\n",
     "from address 65535 there are 1 more; 2 are asked for"},
    {SERVER "kind = \"coil\"\nimage = \"t.out\"\nwritable = true\n",
     "'t.out' is an output image: the PLC puts all of its bytes out anew in each cycle; "
     "allowed is an image with direction = \"input\" or \"memory\""},
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
    {kDeep, "nested too deep"},
};
// A value that was refused has no other errors.
TEST(ModbusRefusals, AWrongValueIsToldOnce) {
  const std::string image = "[[image]]\nname = \"big\"\ndirection = \"input\"\n";
  const std::string maps = "[[device.read]]\nkind = \"coil\"\naddress = 0\nimage = \"big\"\n";
  for (const char* const size : {"size = 0\n", "size = 1048577\n", ""}) {
    const std::string told =
        refused(image + size + DEVICE "status_image = \"big\"\nstatus_offset = 8\n" + maps);
    EXPECT_THAT(told, HasSubstr("[[image]] 'big' size: "));
    EXPECT_THAT(told, Not(HasSubstr("\n")));
  }
  const std::string other = "[[image]]\nname = \"big\"\ndirection = \"outputs\"\nsize = 64\n";
  const std::string writes = "[[device.write]]\nkind = \"coil\"\naddress = 0\nimage = \"big\"\n";
  EXPECT_THAT(refused(other + DEVICE + writes), Not(HasSubstr("\n")));
  EXPECT_THAT(refused(other + DEVICE "status_image = \"big\"\n" READ "kind = \"coil\"\n"),
              Not(HasSubstr("\n")));
  EXPECT_THAT(refused(DEVICE "reconnect_ms = 50\nreconnect_max_ms = 400\n" READ "kind = \"coil\"\n"),
              Not(HasSubstr("\n")));
  EXPECT_THAT(refused(DEVICE "poll_ms = 0\ngone_after_ms = 50\n" READ "kind = \"coil\"\n"),
              Not(HasSubstr("\n")));
}

TEST(ModbusRefusals, AnImageWithoutANameIsNoneOfThoseThatThereAre) {
  const std::string told = refused("[[image]]\nname = \"\"\ndirection = \"input\"\nsize = 8\n" DEVICE
                                   "[[device.read]]\nkind = \"coil\"\naddress = 0\nimage = \"x\"\n");
  EXPECT_THAT(told, HasSubstr("there is no [[image]] 'x'; there are t.in, t.out"));
  const auto none = parse_modbus_config(DEVICE READ "kind = \"coil\"\n", "m.toml");
  ASSERT_FALSE(none.has_value());
  EXPECT_THAT(none.error().front(), HasSubstr("there is no [[image]] 't.in'; there are none"));
}

// Neither key has a meaning then.
TEST(ModbusRefusals, ADefaultThatIsNotUsedRefusesNothing) {
  EXPECT_EQ(refused(DEVICE "poll_ms = 5000\n" READ "kind = \"coil\"\n"), "accepted");
  EXPECT_EQ(refused(DEVICE "when_gone = \"zero\"\npoll_ms = 5000\n" WRITE "kind = \"coil\"\n"), "accepted");
}

INSTANTIATE_TEST_SUITE_P(Each, RefusedModbusConfig, ::testing::ValuesIn(kRefusals));

}  // namespace
}  // namespace plchost::modbus
