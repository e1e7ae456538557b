#pragma once

#include <expected>
#include <string>
#include <string_view>
#include <vector>

#include "instances/io/modbus/config/modbus_config.hpp"

namespace plchost::modbus {

/// All that is wrong, one line of text each: "FILE:LINE:COLUMN: [[device]] 'valves' poll_ms: ...".
using ConfigErrors = std::vector<std::string>;

/// Parses and checks as a whole. Any text, hostile ones included. `file` is for messages.
[[nodiscard]] std::expected<ModbusConfig, ConfigErrors> parse_modbus_config(std::string_view text,
                                                                            const std::string& file);
[[nodiscard]] std::expected<ModbusConfig, ConfigErrors> load_modbus_config(const std::string& file);

}  // namespace plchost::modbus
