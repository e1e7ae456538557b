#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "instances/io/modbus/config/modbus_config.hpp"
#include "shm/toml/section_reader.hpp"

namespace plchost::modbus {

/// The part of the file that a map belongs to.
enum class MapUse : std::uint8_t { device_read, device_write, server };

/// The image of that name; null: a problem was reported.
[[nodiscard]] const ImageConfig* find_image(SectionReader& reader, std::string_view key,
                                            const std::vector<ImageConfig>& images, const std::string& name);

/// Faults of one map: its image, its place there, and what the protocol can do.
void check_map(SectionReader& reader, const std::vector<ImageConfig>& images, const RegisterMap& map,
               MapUse use);

}  // namespace plchost::modbus
