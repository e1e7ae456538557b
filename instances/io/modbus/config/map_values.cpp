#include "instances/io/modbus/config/map_values.hpp"

#include <bit>
#include <cstring>

namespace plchost::modbus {

namespace {

static_assert(std::endian::native == std::endian::little, "the low word of 32 bit lies in front");

// In which word of the map register `index` lies.
std::size_t word_of(RegisterOrder order, std::size_t index) noexcept {
  const bool high_first = order == RegisterOrder::abcd || order == RegisterOrder::badc;
  return high_first ? index ^ 1U : index;
}

std::uint16_t in_order(RegisterOrder order, std::uint16_t value) noexcept {
  const bool swapped = order == RegisterOrder::badc || order == RegisterOrder::dcba;
  return swapped ? static_cast<std::uint16_t>(value << 8U | value >> 8U) : value;
}

}  // namespace

std::size_t byte_of(const RegisterMap& map, std::size_t index) noexcept {
  return map.offset + word_of(map.order, index) * sizeof(std::uint16_t);
}

void put_registers(const RegisterMap& map, std::uint32_t first, std::span<const std::uint16_t> registers,
                   std::span<std::byte> image) noexcept {
  for (std::size_t i = 0; i < registers.size(); ++i) {
    const std::uint16_t value = in_order(map.order, registers[i]);
    std::memcpy(image.data() + byte_of(map, first + i), &value, sizeof value);
  }
}

void get_registers(const RegisterMap& map, std::uint32_t first, std::span<const std::byte> image,
                   std::span<std::uint16_t> registers) noexcept {
  for (std::size_t i = 0; i < registers.size(); ++i) {
    std::uint16_t value = 0;
    std::memcpy(&value, image.data() + byte_of(map, first + i), sizeof value);
    registers[i] = in_order(map.order, value);
  }
}

void put_bits(const RegisterMap& map, std::uint32_t first, std::span<const std::uint8_t> bits,
              std::span<std::byte> image) noexcept {
  std::uint64_t at = first_bit(map) + first;
  for (const std::uint8_t bit : bits) {
    const auto mask = static_cast<std::byte>(1U << (at % 8));
    image[at / 8] = bit != 0 ? image[at / 8] | mask : image[at / 8] & ~mask;
    ++at;
  }
}

void get_bits(const RegisterMap& map, std::uint32_t first, std::span<const std::byte> image,
              std::span<std::uint8_t> bits) noexcept {
  std::uint64_t at = first_bit(map) + first;
  for (std::uint8_t& bit : bits) {
    bit = std::to_integer<std::uint8_t>(image[at / 8] >> (at % 8) & std::byte{1});
    ++at;
  }
}

void put_zeros(const RegisterMap& map, std::span<std::byte> image) noexcept {
  if (!is_bit(map.kind)) {
    std::memset(image.data() + map.offset, 0, map.count * sizeof(std::uint16_t));
    return;
  }
  for (std::uint64_t at = first_bit(map); at < first_bit(map) + map.count; ++at) {
    image[at / 8] &= ~static_cast<std::byte>(1U << (at % 8));
  }
}

}  // namespace plchost::modbus
