#include "instances/io/modbus/images/check_memories.hpp"

#include <fmt/format.h>

#include "instances/io/modbus/images/memory_image.hpp"
#include "shm/base/names.hpp"

namespace plchost::modbus {

ConfigErrors check_memories(const ModbusConfig& config, const std::string& file) {
  ConfigErrors errors;
  for (const ImageConfig& image : config.images) {
    if (image.direction != ImageDirection::memory) continue;
    if (!MemoryImage::is_process_image(config.process.pool, image.name)) continue;
    errors.push_back(
        fmt::format("{}:{}: [[image]] '{}' direction: \"memory\" is for other areas, and '{}' of pool "
                    "'{}' is a process image; allowed are input, output",
                    file, image.direction_line, shown(image.name), shown(image.name), config.process.pool));
  }
  return errors;
}

}  // namespace plchost::modbus
