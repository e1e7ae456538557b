#include "instances/io/modbus/config/map_values.hpp"

#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include <gmock/gmock.h>

namespace plchost::modbus {
namespace {

using ::testing::ElementsAre;

std::vector<unsigned> bytes_of(const std::vector<std::byte>& image) {
  std::vector<unsigned> numbers;
  for (const std::byte byte : image) numbers.push_back(std::to_integer<unsigned>(byte));
  return numbers;
}

RegisterMap registers(RegisterOrder order, std::uint32_t count, std::uint32_t offset = 0) {
  RegisterMap map;
  map.kind = RegisterKind::holding_register;
  map.count = count;
  map.offset = offset;
  map.order = order;
  return map;
}

// On the wire the two registers are 0x1122 and 0x3344.
std::uint32_t value_in(RegisterOrder order) {
  const std::array<std::uint16_t, 2> wire = {0x1122, 0x3344};
  std::vector<std::byte> image(4);
  put_registers(registers(order, 2), 0, wire, image);
  std::uint32_t value = 0;
  std::memcpy(&value, image.data(), sizeof value);
  std::array<std::uint16_t, 2> back{};
  get_registers(registers(order, 2), 0, image, back);
  EXPECT_EQ(back, wire);
  return value;
}

TEST(MapValues, RegistersHaveEachOrderOf32Bit) {
  EXPECT_EQ(value_in(RegisterOrder::abcd), 0x11223344U);
  EXPECT_EQ(value_in(RegisterOrder::cdab), 0x33441122U);
  EXPECT_EQ(value_in(RegisterOrder::badc), 0x22114433U);
  EXPECT_EQ(value_in(RegisterOrder::dcba), 0x44332211U);
}

TEST(MapValues, SingleRegistersLieOneBehindTheOther) {
  const std::array<std::uint16_t, 3> wire = {0x0102, 0x0304, 0x0506};
  std::vector<std::byte> image(8, std::byte{0xff});
  put_registers(registers(RegisterOrder::single, 3, 1), 0, wire, image);
  EXPECT_THAT(bytes_of(image), ElementsAre(0xff, 2, 1, 4, 3, 6, 5, 0xff));
}

TEST(MapValues, PartOfAMapTouchesNoOtherRegister) {
  const std::array<std::uint16_t, 1> wire = {0xaabb};
  std::vector<std::byte> image(8);
  put_registers(registers(RegisterOrder::abcd, 4), 2, wire, image);  // the high word of the second value
  EXPECT_THAT(bytes_of(image), ElementsAre(0, 0, 0, 0, 0, 0, 0xbb, 0xaa));
}

TEST(MapValues, BitsArePackedFromTheLowestOn) {
  RegisterMap map;
  map.kind = RegisterKind::coil;
  map.count = 4;
  map.offset = 1;
  map.bit = 6;
  const std::array<std::uint8_t, 4> bits = {1, 0, 0, 1};
  std::vector<std::byte> image(4, std::byte{0xff});
  image[1] = std::byte{0x80};
  put_bits(map, 0, bits, image);
  EXPECT_THAT(bytes_of(image), ElementsAre(0xff, 0x40, 0xfe, 0xff));
  std::array<std::uint8_t, 4> back{};
  get_bits(map, 0, image, back);
  EXPECT_EQ(back, bits);
  std::array<std::uint8_t, 2> part{};
  get_bits(map, 2, image, part);
  EXPECT_THAT(part, ElementsAre(0, 1));
  put_zeros(map, image);
  EXPECT_THAT(bytes_of(image), ElementsAre(0xff, 0, 0xfc, 0xff));
}

}  // namespace
}  // namespace plchost::modbus
