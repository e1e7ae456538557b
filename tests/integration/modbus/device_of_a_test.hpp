#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "tests/integration/modbus/modbus_peer.hpp"
#include "tests/integration/modbus/modbus_program.hpp"

namespace plchost::testing {

inline bool quality_is(const Plant& plant, unsigned offset, modbus::Quality quality) {
  return plant.status(offset).quality == static_cast<std::uint16_t>(quality);
}

// A device with an input register at byte 0, an output register, and its status at byte 56.
inline std::string device(const HeldPort& port, std::string_view more = "") {
  return fmt::format(R"(
[[device]]
name = "valves"
tcp = "{}"
poll_ms = 10
timeout_ms = 200
reconnect_ms = 100
reconnect_max_ms = 200
gone_after_ms = 300
status_image = "t.in"
status_offset = 56
{}
[[device.read]]
kind = "input_register"
address = 100
image = "t.in"
[[device.write]]
kind = "holding_register"
address = 7
count = 2
image = "t.out"
)",
                     port.address(), more);
}

// The maps of a device with an input register at byte `offset`, its status 40 bytes behind, and `outputs`
// output registers from `unit` on.
inline std::string unit_maps(int unit, int offset, int outputs) {
  return fmt::format(R"(
status_image = "t.in"
status_offset = {2}
[[device.read]]
kind = "input_register"
address = 100
image = "t.in"
offset = {1}
[[device.write]]
kind = "holding_register"
address = {0}
count = {3}
image = "t.out"
)",
                     unit, offset, 40 + offset, outputs);
}

// A device with unit_maps() of two outputs.
inline std::string serial_device(const SerialLine& line, int unit, int offset) {
  return fmt::format(R"(
[[device]]
name = "unit{1}"
serial = "{0}"
parity = "none"
unit = {1}
poll_ms = 20
timeout_ms = 200
reconnect_ms = 100
reconnect_max_ms = 2000)",
                     line.path(), unit) +
         unit_maps(unit, offset, 2);
}

// A PLC that puts this word out again and again, until the register that device() writes has it.
inline bool follows(Plant& plant, ModbusPeer& peer, std::uint16_t word) {
  return eventually([&] {
    plant.put_out(0, word);
    return peer.holding(7) == word;
  });
}

// The register that device() reads.
inline void measure(ModbusPeer& peer, std::uint16_t value) {
  peer.with([&](modbus_mapping_t& mapping) { mapping.tab_input_registers[100] = value; });
}

}  // namespace plchost::testing
