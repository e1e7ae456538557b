#pragma once

#include <string>

#include "instances/io/modbus/config/load_modbus.hpp"
#include "instances/io/modbus/config/modbus_config.hpp"

namespace plchost::modbus {

/// The memory areas of the configuration that are process images at the moment: their clients would read and
/// write the header of an image. `file` is for messages. Set-up.
[[nodiscard]] ConfigErrors check_memories(const ModbusConfig& config, const std::string& file);

}  // namespace plchost::modbus
