#pragma once

#include <cstdint>
#include <expected>
#include <span>
#include <vector>

#include <modbus/modbus.h>

#include "instances/io/modbus/config/map_values.hpp"
#include "instances/io/modbus/config/modbus_config.hpp"
#include "instances/io/modbus/images/image_table.hpp"
#include "instances/io/modbus/server/request.hpp"

namespace plchost::modbus {

/// The registers of the server, each of which lies in an image. A request may go over several maps. One
/// thread.
class ServedMaps {
 public:
  /// The images are those of the configuration.
  ServedMaps(const ServerConfig& config, const ImageTable& images);

  /// The values of these registers, or the number of an exception. A request that writes needs maps that are
  /// writable.
  [[nodiscard]] std::expected<void, std::uint8_t> read(const Request& request, MapValues& values) const;
  /// After a read() of the same request. False: a memory area has gone since.
  [[nodiscard]] bool write(const Request& request, MapValues& values) const;

 private:
  struct Served {
    const RegisterMap* map;
    InputImage* input;  ///< or null
    OutputImage* output;
    MemoryImage* memory;
  };
  /// The part of a request that lies in one map.
  struct Part {
    std::uint32_t first_of_map;
    std::uint32_t first_of_request;
    std::uint32_t count;
  };
  [[nodiscard]] static Part part_of(const RegisterMap& map, const Request& request) noexcept;
  [[nodiscard]] static bool write_part(const Served& served, const Part& part, MapValues& values);
  [[nodiscard]] bool read_part(const Served& served, const Part& part, MapValues& values) const;

  Duration silent_after_;
  std::vector<Served> maps_;
};

/// Answers a whole frame at the socket of `context`. False: the connection is to be closed.
[[nodiscard]] bool answer(modbus_t* context, const ServedMaps& maps, std::span<const std::uint8_t> frame);

}  // namespace plchost::modbus
