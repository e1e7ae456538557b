#pragma once

#include <vector>

#include "instances/io/modbus/config/modbus_config.hpp"
#include "shm/toml/toml_document.hpp"

namespace plchost::modbus {

/// Finds faults that only show when all is known. Two things have one name, or two devices are one. Two maps
/// write the same bits of an image or the same registers of a device, or show the same registers of the
/// server. Each problem names both lines.
void check_overlaps(const ModbusConfig& config, std::vector<ConfigProblem>& problems);

}  // namespace plchost::modbus
