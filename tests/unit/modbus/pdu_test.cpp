#include "instances/io/modbus/client/pdu.hpp"

#include <cstdint>
#include <vector>

#include <gmock/gmock.h>

namespace plchost::modbus {
namespace {

using Bytes = std::vector<std::uint8_t>;

RegisterMap map_of(RegisterKind kind, std::uint16_t address, std::uint32_t count) {
  RegisterMap map;
  map.kind = kind;
  map.address = address;
  map.count = count;
  return map;
}

Bytes bytes_of(const Pdu& pdu) {
  return {pdu.view().begin(), pdu.view().end()};
}

Bytes written(const RegisterMap& map, const std::vector<int>& given) {
  MapValues values;
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (is_bit(map.kind)) {
      values.bits(map.count)[i] = static_cast<std::uint8_t>(given[i]);
    } else {
      values.registers(map.count)[i] = static_cast<std::uint16_t>(given[i]);
    }
  }
  return bytes_of(write_request(map, values));
}

TEST(ModbusPdu, EachTableHasItsFunction) {
  EXPECT_EQ(bytes_of(read_request(map_of(RegisterKind::coil, 0x102, 2000))), (Bytes{1, 1, 2, 7, 0xd0}));
  EXPECT_EQ(bytes_of(read_request(map_of(RegisterKind::discrete_input, 0, 1))), (Bytes{2, 0, 0, 0, 1}));
  EXPECT_EQ(bytes_of(read_request(map_of(RegisterKind::holding_register, 0xffff, 1))),
            (Bytes{3, 0xff, 0xff, 0, 1}));
  EXPECT_EQ(bytes_of(read_request(map_of(RegisterKind::input_register, 7, 125))), (Bytes{4, 0, 7, 0, 125}));
  EXPECT_EQ(written(map_of(RegisterKind::coil, 7, 1), {1}), (Bytes{5, 0, 7, 0xff, 0}));
  EXPECT_EQ(written(map_of(RegisterKind::coil, 7, 1), {0}), (Bytes{5, 0, 7, 0, 0}));
  EXPECT_EQ(written(map_of(RegisterKind::holding_register, 7, 1), {0x1234}), (Bytes{6, 0, 7, 0x12, 0x34}));
  EXPECT_EQ(written(map_of(RegisterKind::coil, 7, 9), {1, 0, 0, 0, 0, 0, 0, 1, 1}),
            (Bytes{15, 0, 7, 0, 9, 2, 0x81, 1}));
  EXPECT_EQ(written(map_of(RegisterKind::holding_register, 7, 2), {0xfffe, 1}),
            (Bytes{16, 0, 7, 0, 2, 4, 0xff, 0xfe, 0, 1}));
}

TEST(ModbusPdu, TheFunctionOfAWriteCanBeChosen) {
  RegisterMap map = map_of(RegisterKind::holding_register, 7, 1);
  EXPECT_TRUE(is_one_write(map));
  map.function = WriteFunction::several;
  EXPECT_TRUE(is_one_write(map));
  EXPECT_EQ(written(map, {0x1234}), (Bytes{16, 0, 7, 0, 1, 2, 0x12, 0x34}));
  EXPECT_EQ(write_shape(map).function, 16);
  map.kind = RegisterKind::coil;
  EXPECT_EQ(written(map, {1}), (Bytes{15, 0, 7, 0, 1, 1, 1}));
  map.function = WriteFunction::single;
  EXPECT_EQ(written(map, {1}), (Bytes{5, 0, 7, 0xff, 0}));
  EXPECT_TRUE(is_one_write(map));
  map.count = 2;
  EXPECT_FALSE(is_one_write(map));
  EXPECT_EQ(write_shape(map).function, 5);
  map.function = WriteFunction::automatic;
  EXPECT_TRUE(is_one_write(map));
}

// Those of a gateway say that the device is not there.
TEST(ModbusPdu, ARefusalIsAnExceptionOfTheDeviceItself) {
  MapValues values;
  const RegisterMap map = map_of(RegisterKind::input_register, 0, 1);
  for (int code = 1; code <= 255; ++code) {
    const auto taken = take_values(map, Bytes{0x84, static_cast<std::uint8_t>(code)}, values);
    EXPECT_EQ(taken.error().is_refusal(), code != 10 && code != 11) << code;
  }
  EXPECT_FALSE(take_values(map, Bytes{}, values).error().is_refusal());
}

TEST(ModbusPdu, TheLongestRequestsFit) {
  MapValues values;
  EXPECT_EQ(write_request(map_of(RegisterKind::coil, 0, kMaxWriteBits), values).size, 6 + 246);
  EXPECT_EQ(write_request(map_of(RegisterKind::holding_register, 0, kMaxWriteRegisters), values).size,
            6 + 246);
}

TEST(ModbusPdu, ValuesAreTaken) {
  MapValues values;
  EXPECT_TRUE(
      take_values(map_of(RegisterKind::input_register, 0, 2), Bytes{4, 4, 0x12, 0x34, 0xff, 0}, values));
  EXPECT_EQ(values.registers(2)[0], 0x1234);
  EXPECT_EQ(values.registers(2)[1], 0xff00);
  EXPECT_TRUE(take_values(map_of(RegisterKind::coil, 0, 9), Bytes{1, 2, 0x81, 1}, values));
  EXPECT_THAT(values.bits(9), ::testing::ElementsAre(1, 0, 0, 0, 0, 0, 0, 1, 1));
}

TEST(ModbusPdu, OnlyWhatWasAskedForIsTaken) {
  const RegisterMap map = map_of(RegisterKind::input_register, 0, 1);
  for (const Bytes& wrong : {Bytes{}, Bytes{4}, Bytes{4, 2}, Bytes{4, 2, 1}, Bytes{4, 2, 1, 2, 3},
                             Bytes{3, 2, 1, 2}, Bytes{4, 4, 1, 2}, Bytes{4, 4, 1, 2, 3, 4}, Bytes{0x84},
                             Bytes{0x84, 0}, Bytes{0x84, 2, 2}, Bytes{0x83, 2}}) {
    MapValues values;
    const auto taken = take_values(map, wrong, values);
    ASSERT_FALSE(taken.has_value()) << ::testing::PrintToString(wrong);
    EXPECT_EQ(taken.error().exception, 0) << ::testing::PrintToString(wrong);
    EXPECT_EQ(values, MapValues()) << "nothing of it is taken";
  }
}

TEST(ModbusPdu, EachExceptionIsTold) {
  MapValues values;
  const RegisterMap map = map_of(RegisterKind::input_register, 0, 1);
  for (int code = 1; code <= 255; ++code) {
    const auto taken = take_values(map, Bytes{0x84, static_cast<std::uint8_t>(code)}, values);
    ASSERT_FALSE(taken.has_value());
    EXPECT_EQ(taken.error().exception, code);
    EXPECT_FALSE(taken.error().text.empty());
  }
}

TEST(ModbusPdu, AShapeIsThatOfAGoodResponse) {
  EXPECT_EQ(read_shape(map_of(RegisterKind::input_register, 7, 2)),
            (ResponseShape{.function = 4, .size = 6}));
  EXPECT_EQ(read_shape(map_of(RegisterKind::coil, 7, 9)), (ResponseShape{.function = 1, .size = 4}));
  EXPECT_EQ(read_shape(map_of(RegisterKind::coil, 7, 8)), (ResponseShape{.function = 1, .size = 3}));
  EXPECT_EQ(write_shape(map_of(RegisterKind::coil, 7, 1)), (ResponseShape{.function = 5, .size = 5}));
  EXPECT_EQ(write_shape(map_of(RegisterKind::holding_register, 7, 2)),
            (ResponseShape{.function = 16, .size = 5}));
}

TEST(ModbusPdu, AWriteIsConfirmedWithItsAddressAndItsCountOrValue) {
  MapValues values;
  const Pdu single = write_request(map_of(RegisterKind::coil, 7, 1), values);
  EXPECT_TRUE(check_written(single, Bytes{5, 0, 7, 0, 0}));
  EXPECT_FALSE(check_written(single, Bytes{5, 0, 7, 0xff, 0}));
  EXPECT_FALSE(check_written(single, Bytes{5, 0, 8, 0, 0}));
  EXPECT_FALSE(check_written(single, Bytes{5, 0, 7, 0}));
  EXPECT_FALSE(check_written(single, Bytes{5, 0, 7, 0, 0, 0}));
  EXPECT_EQ(check_written(single, Bytes{0x85, 4}).error().exception, 4);
  const Pdu several = write_request(map_of(RegisterKind::holding_register, 7, 3), values);
  EXPECT_TRUE(check_written(several, Bytes{16, 0, 7, 0, 3}));
  EXPECT_FALSE(check_written(several, Bytes{16, 0, 7, 0, 2}));
}

}  // namespace
}  // namespace plchost::modbus
