// The keys of the file of plchost-modbus: one row each. Reading, ranges, errors and the table of
// instances/io/modbus/modbus.md come from here.

#include "instances/io/modbus/config/modbus_keys.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "instances/io/modbus/config/endpoint.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log_levels.hpp"
#include "shm/plc_process_image.h"
#include "shm/toml/key_kinds.hpp"

namespace plchost::modbus {

namespace {

using std::chrono::milliseconds;

/// A key that must be there.
template <class Kind>
struct RequiredKey {
  template <class Value>
  static void read(const ModbusReading& reading, SectionReader& reader, std::string_view name,
                   Value& target) {
    Kind::read(reading, reader, name, target);
    if (!reader.has(name)) reader.problem(name, fmt::format("is missing; allowed is {}", Kind::allowed()));
  }
  static std::string allowed() { return Kind::allowed(); }
  template <class Value>
  static std::string shown(const Value& /*value*/) {
    return "required";
  }
};

constexpr std::array kBauds = {1200, 2400, 4800, 9600, 19'200, 38'400, 57'600, 115'200};

/// One of the speeds of a serial line.
struct BaudKey {
  static void read(const ModbusReading& /*reading*/, SectionReader& reader, std::string_view name,
                   int& target) {
    std::int64_t baud = target;
    reader.number(name, kBauds.front(), kBauds.back(), baud);
    if (reader.wrong(name)) return;
    if (std::ranges::find(kBauds, baud) == kBauds.end()) {
      return reader.problem(name, fmt::format("{} is no speed; allowed are {}", baud, allowed()));
    }
    target = static_cast<int>(baud);
  }
  static std::string allowed() { return fmt::format("{}", fmt::join(kBauds, ", ")); }
  static std::string shown(int value) { return fmt::format("{}", value); }
};

struct EndpointRule {
  static std::string form() { return std::string(kEndpointForm); }
  static std::string wrong(const ModbusReading& /*reading*/, const std::string& text) {
    const auto endpoint = text.empty() ? Endpoint{} : parse_endpoint(text);
    return endpoint ? "" : endpoint.error();
  }
};

struct ImageNameRule {
  static std::string form() { return "the name of an image"; }
  static std::string wrong(const ModbusReading& /*reading*/, const std::string& text) {
    const auto good = text.empty() ? Result<void>() : check_object_name(text);
    return good ? "" : good.error().message;
  }
};

struct SerialRule {
  static std::string form() { return "an absolute path, like \"/dev/ttyUSB0\""; }
  static std::string wrong(const ModbusReading& /*reading*/, const std::string& text) {
    if (text.empty() || (text.starts_with('/') && text.size() <= kMaxPath)) return "";
    return fmt::format("\"{}\" is no path; allowed is {}", plchost::shown(text), form());
  }
};

using PollKey = TimeKey<milliseconds, 1, 3'600'000>;
using TimeoutKey = TimeKey<milliseconds, 10, 10'000>;
using DelayKey = TimeKey<milliseconds, 100, 3'600'000>;
using AgeKey = TimeKey<milliseconds, 10, 3'600'000>;
using OptionalTimeKey = TimeKey<milliseconds, 0, 3'600'000>;
using AddressKey = NumberKey<0, kRegisterSpace - 1>;
using OffsetKey = NumberKey<0, PLC_IMAGE_MAX_SIZE - 1>;

constexpr std::string_view kEachMap = "[[device.read]], [[device.write]], [[server.map]]";

template <auto Member, class Kind>
constexpr auto key(std::string_view section, const ModbusKey& key) {
  return KeyAccess<Member>::template row<Kind, ModbusReading>(section, key);
}

constexpr std::array kProcessKeys = {
    key<&ProcessConfig::pool, TextKey<NameRule<kMaxInstanceName>>>(
        "[modbus]", {.name = "pool", .meaning = "object pool of the host (`[host] pool`)"}),
    key<&ProcessConfig::log_level, WordKey<kLogLevels>>(
        "[modbus]", {.name = "log_level", .meaning = "the least level that is logged"}),
};

constexpr std::array kImageKeys = {
    key<&ImageConfig::name, RequiredKey<TextKey<ImageNameRule>>>(
        "[[image]]", {.name = "name", .meaning = "memory of the pool (`[SysMem] Area.0.Object`)"}),
    key<&ImageConfig::direction, RequiredKey<WordKey<kDirectionNames>>>(
        "[[image]]",
        {.name = "direction",
         .meaning = "seen from the PLC: this process alone writes an input image, an instance an output "
                    "image. `memory`: another area, which the server shows, and its clients may write"}),
    key<&ImageConfig::size, RequiredKey<NumberKey<1, PLC_IMAGE_MAX_SIZE>>>(
        "[[image]]", {.name = "size", .meaning = "bytes (`[SysMem] Area.0.Size`)"}),
};

constexpr std::array kDeviceKeys = {
    key<&DeviceConfig::name, RequiredNameKey<kMaxInstanceName>>(
        "[[device]]", {.name = "name", .meaning = "name of the device in messages"}),
    key<&DeviceConfig::tcp, TextKey<EndpointRule>>(
        "[[device]]", {.name = "tcp",
                       .meaning = "address of a device on Modbus TCP. The port is 502 by "
                                  "default. Host names are refused"}),
    key<&DeviceConfig::serial, TextKey<SerialRule>>(
        "[[device]]", {.name = "serial",
                       .meaning = "serial line of a device on Modbus RTU. Devices of one line take turns"}),
    key<&DeviceConfig::baud, BaudKey>("[[device]]",
                                      {.name = "baud", .meaning = "bits per second of the serial line"}),
    key<&DeviceConfig::parity, WordKey<kParityNames>>(
        "[[device]]", {.name = "parity", .meaning = "parity of the serial line"}),
    key<&DeviceConfig::stop_bits, NumberKey<1, 2>>(
        "[[device]]", {.name = "stop_bits", .meaning = "stop bits of the serial line"}),
    key<&DeviceConfig::unit, NumberKey<0, 255>>(
        "[[device]]",
        {.name = "unit", .meaning = "unit identifier; at a serial line 1 to 247, which is its address"}),
    key<&DeviceConfig::share_connection, TruthKey>(
        "[[device]]", {.name = "share_connection",
                       .meaning = "on TCP: units of one address take turns on one connection, as gateways "
                                  "need that have only one. False: a connection of its own"}),
    key<&DeviceConfig::probe, TruthKey>(
        "[[device]]",
        {.name = "probe",
         .meaning = "at a serial line: reads that [tell late responses apart](#devices). False: "
                    "for a device that does not answer these"}),
    key<&DeviceConfig::poll, PollKey>(
        "[[device]]", {.name = "poll_ms", .meaning = "time between two polls, on a fixed grid"}),
    key<&DeviceConfig::timeout, TimeoutKey>(
        "[[device]]",
        {.name = "timeout_ms", .meaning = "time for a connection, and for each whole response"}),
    key<&DeviceConfig::reconnect, DelayKey>(
        "[[device]]",
        {.name = "reconnect_ms", .meaning = "pause after a failed poll, doubled with each in a row"}),
    key<&DeviceConfig::reconnect_max, DelayKey>(
        "[[device]]",
        {.name = "reconnect_max_ms", .meaning = "the longest such pause, at least `reconnect_ms`"}),
    key<&DeviceConfig::when_gone, WordKey<kLossNames>>(
        "[[device]]", {.name = "when_gone",
                       .meaning = "inputs of a device that does not answer: its last values, or zeros"}),
    key<&DeviceConfig::gone_after, AgeKey>(
        "[[device]]", {.name = "gone_after_ms", .meaning = "age of the inputs at which `when_gone` applies"}),
    key<&DeviceConfig::when_silent, WordKey<kLossNames>>(
        "[[device]]", {.name = "when_silent",
                       .meaning = "outputs of a [silent](#safe-states) PLC, and at the end of this process: "
                                  "nothing more is sent, or zeros"}),
    key<&DeviceConfig::silent_after, AgeKey>(
        "[[device]]", {.name = "silent_after_ms",
                       .meaning = "silence after which `when_silent` applies: longer than the interval of "
                                  "each task that writes the outputs"}),
    key<&DeviceConfig::status_image, TextKey<ImageNameRule>>(
        "[[device]]",
        {.name = "status_image", .meaning = "input image that gets the [status](#status) of the device"}),
    key<&DeviceConfig::status_offset, OffsetKey>(
        "[[device]]", {.name = "status_offset", .meaning = "byte of the status in that image; it has 8"}),
};

constexpr std::array kServerKeys = {
    key<&ServerConfig::listen, TextKey<EndpointRule>>(
        "[server]", {.name = "listen",
                     .meaning = "address of the server. Another one than loopback needs "
                                "`allow_unsecured`"}),
    key<&ServerConfig::allow_unsecured, TruthKey>(
        "[server]",
        {.name = "allow_unsecured",
         .meaning = "Modbus has no security: all who reach the address read, and write what is `writable`"}),
    key<&ServerConfig::connections, NumberKey<1, kMaxServerConnections>>(
        "[server]", {.name = "connections", .meaning = "clients at a time; further ones are closed"}),
    key<&ServerConfig::idle_timeout, TimeKey<milliseconds, 100, 3'600'000>>(
        "[server]", {.name = "idle_timeout_ms",
                     .meaning = "time for the next whole request, after which the connection is closed"}),
    key<&ServerConfig::silent_after, OptionalTimeKey>(
        "[server]",
        {.name = "silent_after_ms",
         .meaning = "outputs of a PLC that is silent for longer are answered with exception 4; 0: never"}),
};

constexpr std::array kMapKeys = {
    key<&RegisterMap::kind, RequiredKey<WordKey<kKindNames>>>(
        kEachMap, {.name = "kind",
                   .meaning = "the table of the device; coils and holding registers can be "
                              "written"}),
    key<&RegisterMap::address, RequiredKey<AddressKey>>(
        kEachMap, {.name = "address",
                   .meaning = "the first register or bit, as it is on the wire: 0 is the one that "
                              "manuals call 40001, 30001, 10001 or 1"}),
    key<&RegisterMap::count, NumberKey<1, kRegisterSpace>>(
        kEachMap,
        {.name = "count",
         .meaning = "registers or bits. A device is asked for at most 125 registers or 2000 bits by "
                    "one map, and written 123 or 1968"}),
    key<&RegisterMap::image, RequiredKey<TextKey<ImageNameRule>>>(
        kEachMap,
        {.name = "image",
         .meaning = "an input image for `[[device.read]]`, an output image for `[[device.write]]`, an "
                    "input image or a memory if `writable`"}),
    key<&RegisterMap::offset, OffsetKey>(
        kEachMap, {.name = "offset", .meaning = "first byte in the image. A register has two"}),
    key<&RegisterMap::bit, NumberKey<0, 7>>(
        kEachMap, {.name = "bit", .meaning = "coils and discrete inputs: first bit in that byte"}),
    key<&RegisterMap::order, WordKey<kOrderNames>>(
        kEachMap,
        {.name = "order",
         .meaning = "registers: words of 16 bit, or pairs of them as values of 32 bit. `abcd` has the "
                    "highest byte first on the wire, `cdab` the low register first"}),
};

constexpr std::array kReadMapKeys = {
    key<&RegisterMap::optional, TruthKey>(
        "[[device.read]]", {.name = "optional",
                            .meaning = "the device may refuse it: its values are as `when_gone` says, and "
                                       "the others are read"}),
};

constexpr std::array kWriteMapKeys = {
    key<&RegisterMap::function, WordKey<kFunctionNames>>(
        "[[device.write]]",
        {.name = "function",
         .meaning = "`single`: 6 or 5, a request for each register or coil. `several`: 16 or 15, also for "
                    "one. `auto`: `single` for a `count` of 1, else `several`"}),
    key<&RegisterMap::rewrite, OptionalTimeKey>(
        "[[device.write]]",
        {.name = "rewrite_ms",
         .meaning = "unchanged outputs are written again after that time; 0: only changed ones are written"}),
};

constexpr std::array kServerMapKeys = {
    key<&RegisterMap::writable, TruthKey>(
        "[[server.map]]", {.name = "writable",
                           .meaning = "clients may write it; for coils and holding registers in an input "
                                      "image or a [memory area](#server)"}),
};

// Beside the keys: the line, and the tables below a section.
static_assert(kProcessKeys.size() == count_members<ProcessConfig>(), "each key of [modbus] has its row");
static_assert(kImageKeys.size() + 2 == count_members<ImageConfig>(), "each key of [[image]] has its row");
static_assert(kDeviceKeys.size() + 3 == count_members<DeviceConfig>(), "each key of [[device]] has its row");
static_assert(kServerKeys.size() + 2 == count_members<ServerConfig>(), "each key of [server] has its row");
static_assert(kMapKeys.size() + kReadMapKeys.size() + kWriteMapKeys.size() + kServerMapKeys.size() + 1 ==
                  count_members<RegisterMap>(),
              "each key of a map has its row");

}  // namespace

std::span<const ModbusRow<ProcessConfig>> process_keys() noexcept {
  return kProcessKeys;
}
std::span<const ModbusRow<ImageConfig>> image_keys() noexcept {
  return kImageKeys;
}
std::span<const ModbusRow<DeviceConfig>> device_keys() noexcept {
  return kDeviceKeys;
}
std::span<const ModbusRow<ServerConfig>> server_keys() noexcept {
  return kServerKeys;
}
std::span<const ModbusRow<RegisterMap>> map_keys() noexcept {
  return kMapKeys;
}
std::span<const ModbusRow<RegisterMap>> read_map_keys() noexcept {
  return kReadMapKeys;
}
std::span<const ModbusRow<RegisterMap>> write_map_keys() noexcept {
  return kWriteMapKeys;
}
std::span<const ModbusRow<RegisterMap>> server_map_keys() noexcept {
  return kServerMapKeys;
}

std::string modbus_key_table() {
  std::string table(kKeyTableHead);
  add_section(kProcessKeys, table);
  add_section(kImageKeys, table);
  add_section(kDeviceKeys, table);
  add_section(kServerKeys, table);
  add_section(kMapKeys, table);
  add_section(kReadMapKeys, table);
  add_section(kWriteMapKeys, table);
  add_section(kServerMapKeys, table);
  return table;
}

}  // namespace plchost::modbus
