#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "instances/io/modbus/config/load_modbus.hpp"
#include "instances/io/modbus/config/map_values.hpp"
#include "shm/plc_process_image.h"

// Any text is either refused with at least one error that begins with the file's name, or accepted. Then each
// map lies in its image, and can be read and written there.
namespace {

using namespace plchost::modbus;

std::vector<std::byte> image_of(const ModbusConfig& config, const std::string& name) {
  for (const ImageConfig& image : config.images) {
    if (image.name == name && image.size <= PLC_IMAGE_MAX_SIZE) return std::vector<std::byte>(image.size);
  }
  std::abort();
}

void use(const ModbusConfig& config, const std::vector<RegisterMap>& maps) {
  if (maps.size() > kMaxMaps) std::abort();
  for (const RegisterMap& map : maps) {
    auto image = image_of(config, map.image);
    put_zeros(map, image);
    if (map.address + map.count > kRegisterSpace) std::abort();
    if (is_bit(map.kind)) {
      std::vector<std::uint8_t> bits(map.count, 1);
      put_bits(map, 0, bits, image);
      get_bits(map, 0, image, bits);
    } else {
      std::vector<std::uint16_t> registers(map.count, 1);
      put_registers(map, 0, registers, image);
      get_registers(map, 0, image, registers);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto config = parse_modbus_config({reinterpret_cast<const char*>(data), size}, "/etc/m.toml");
  if (!config) {
    if (config.error().empty()) std::abort();
    for (const auto& error : config.error()) {
      if (!error.starts_with("/etc/m.toml:")) std::abort();
    }
    return 0;
  }
  if (config->devices.size() > kMaxDevices || config->images.size() > kMaxImages) std::abort();
  if (config->devices.empty() && !config->server) std::abort();
  for (const DeviceConfig& device : config->devices) {
    use(*config, device.reads);
    use(*config, device.writes);
    for (const RegisterMap& map : device.reads) {
      if (map.count > (is_bit(map.kind) ? kMaxReadBits : kMaxReadRegisters)) std::abort();
    }
    if (device.status_image.empty()) continue;
    if (image_of(*config, device.status_image).size() < device.status_offset + sizeof(DeviceStatus))
      std::abort();
  }
  if (config->server) use(*config, config->server->maps);
  return 0;
}
