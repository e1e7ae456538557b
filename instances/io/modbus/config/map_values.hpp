#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "instances/io/modbus/config/modbus_config.hpp"

namespace plchost::modbus {

// Between the values of a map, as libmodbus has them, and its bytes in an image. `first` is the number of the
// first value within the map; as many values follow as the span has. The image is as large as the
// configuration says, and the map lies in it. Pure.

void put_registers(const RegisterMap& map, std::uint32_t first, std::span<const std::uint16_t> registers,
                   std::span<std::byte> image) noexcept;
void get_registers(const RegisterMap& map, std::uint32_t first, std::span<const std::byte> image,
                   std::span<std::uint16_t> registers) noexcept;
/// A bit is one byte of the span: 0 or another value.
void put_bits(const RegisterMap& map, std::uint32_t first, std::span<const std::uint8_t> bits,
              std::span<std::byte> image) noexcept;
void get_bits(const RegisterMap& map, std::uint32_t first, std::span<const std::byte> image,
              std::span<std::uint8_t> bits) noexcept;

/// The byte of register `index` of the map in its image.
[[nodiscard]] std::size_t byte_of(const RegisterMap& map, std::size_t index) noexcept;

/// All values of the map become 0.
void put_zeros(const RegisterMap& map, std::span<std::byte> image) noexcept;

/// Values of one map, of its kind: registers, or bits.
class MapValues {
 public:
  void read_from(const RegisterMap& map, std::span<const std::byte> image) noexcept {
    if (is_bit(map.kind)) return get_bits(map, 0, image, bits(map.count));
    get_registers(map, 0, image, registers(map.count));
  }
  void write_to(const RegisterMap& map, std::span<std::byte> image) noexcept {
    if (is_bit(map.kind)) return put_bits(map, 0, bits(map.count), image);
    put_registers(map, 0, registers(map.count), image);
  }
  [[nodiscard]] std::span<std::uint8_t> bits(std::uint32_t count) noexcept {
    return std::span(bits_).first(count);
  }
  [[nodiscard]] std::span<std::uint16_t> registers(std::uint32_t count) noexcept {
    return std::span(registers_).first(count);
  }
  bool operator==(const MapValues&) const = default;

 private:
  // libmodbus unpacks whole bytes.
  std::array<std::uint8_t, kMaxReadBits + 8> bits_{};
  std::array<std::uint16_t, kMaxReadRegisters> registers_{};
};

}  // namespace plchost::modbus
