#include "instances/io/modbus/server/served_maps.hpp"

#include <algorithm>

namespace plchost::modbus {

ServedMaps::ServedMaps(const ServerConfig& config, const ImageTable& images)
    : silent_after_(config.silent_after) {
  for (const RegisterMap& map : config.maps) {
    maps_.push_back({.map = &map,
                     .input = images.input(map.image),
                     .output = images.output(map.image),
                     .memory = images.memory(map.image)});
    if (map.writable && maps_.back().memory != nullptr) maps_.back().memory->make_writable();
  }
}

ServedMaps::Part ServedMaps::part_of(const RegisterMap& map, const Request& request) noexcept {
  const std::uint32_t begin = std::max<std::uint32_t>(map.address, request.address);
  const std::uint32_t end = std::min(map.address + map.count, std::uint32_t{request.address} + request.count);
  if (map.kind != request.kind || end <= begin) return {};
  return {
      .first_of_map = begin - map.address, .first_of_request = begin - request.address, .count = end - begin};
}

// Maps do not overlap, so the parts of a request cover it if they are as many.
std::expected<void, std::uint8_t> ServedMaps::read(const Request& request, MapValues& values) const {
  const auto refused = [](unsigned exception) {
    return std::unexpected(static_cast<std::uint8_t>(exception));
  };
  std::uint32_t covered = 0;
  for (const Served& served : maps_) {
    const Part part = part_of(*served.map, request);
    if (part.count == 0 || (request.writes && !served.map->writable)) continue;
    if (!read_part(served, part, values)) return refused(MODBUS_EXCEPTION_SLAVE_OR_SERVER_FAILURE);
    covered += part.count;
  }
  if (covered != request.count) return refused(MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS);
  return {};
}

bool ServedMaps::read_part(const Served& served, const Part& part, MapValues& values) const {
  const RegisterMap& map = *served.map;
  const auto get = [&](std::span<const std::byte> bytes) {
    const std::uint32_t end = part.first_of_request + part.count;
    if (is_bit(map.kind)) {
      get_bits(map, part.first_of_map, bytes, values.bits(end).subspan(part.first_of_request));
    } else {
      get_registers(map, part.first_of_map, bytes, values.registers(end).subspan(part.first_of_request));
    }
  };
  if (served.input != nullptr) {
    served.input->look(get);
    return true;
  }
  if (served.memory != nullptr) return served.memory->look(get);
  bool fresh = false;
  served.output->look([&](std::span<const std::byte> bytes, const OutputImage::Shown& shown) {
    fresh = silent_after_ == Duration::zero() || shown.silence < silent_after_;
    if (fresh) get(bytes);
  });
  return fresh;
}

bool ServedMaps::write(const Request& request, MapValues& values) const {
  bool written = true;
  for (const Served& served : maps_) {
    const Part part = part_of(*served.map, request);
    if (part.count == 0 || !served.map->writable) continue;
    written = write_part(served, part, values) && written;
  }
  return written;
}

bool ServedMaps::write_part(const Served& served, const Part& part, MapValues& values) {
  const RegisterMap& map = *served.map;
  const std::uint32_t end = part.first_of_request + part.count;
  if (is_bit(map.kind)) {
    const auto bits = values.bits(end).subspan(part.first_of_request);
    if (served.memory != nullptr) return served.memory->put_bits(map, part.first_of_map, bits);
    served.input->update([&](std::span<std::byte> bytes) { put_bits(map, part.first_of_map, bits, bytes); });
  } else {
    const auto registers = values.registers(end).subspan(part.first_of_request);
    if (served.memory != nullptr) return served.memory->put_registers(map, part.first_of_map, registers);
    served.input->update(
        [&](std::span<std::byte> bytes) { put_registers(map, part.first_of_map, registers, bytes); });
  }
  return true;
}

bool answer(modbus_t* context, const ServedMaps& maps, std::span<const std::uint8_t> frame) {
  MapValues values;
  const auto request = parse_request(frame);
  const auto read = request ? maps.read(*request, values) : std::unexpected(request.error());
  if (!read) return modbus_reply_exception(context, frame.data(), read.error()) > 0;
  // Only the table that is asked for, and only these registers: libmodbus can touch nothing else.
  modbus_mapping_t mapping{};
  const auto kind = request->kind;
  (kind == RegisterKind::coil               ? mapping.start_bits
   : kind == RegisterKind::discrete_input   ? mapping.start_input_bits
   : kind == RegisterKind::holding_register ? mapping.start_registers
                                            : mapping.start_input_registers) = request->address;
  (kind == RegisterKind::coil               ? mapping.nb_bits
   : kind == RegisterKind::discrete_input   ? mapping.nb_input_bits
   : kind == RegisterKind::holding_register ? mapping.nb_registers
                                            : mapping.nb_input_registers) = request->count;
  mapping.tab_bits = mapping.tab_input_bits = values.bits(request->count).data();
  mapping.tab_registers = mapping.tab_input_registers = values.registers(kMaxReadRegisters).data();
  // Before the answer: a client that has it may look at the image.
  if (request->writes) {
    take_written(frame, *request, values);
    if (!maps.write(*request, values)) {
      return modbus_reply_exception(context, frame.data(), MODBUS_EXCEPTION_SLAVE_OR_SERVER_FAILURE) > 0;
    }
  }
  return modbus_reply(context, frame.data(), static_cast<int>(frame.size()), &mapping) > 0;
}

}  // namespace plchost::modbus
