#include "instances/io/modbus/server/request.hpp"

#include <cstdint>
#include <vector>

#include <gmock/gmock.h>

namespace plchost::modbus {
namespace {

// A frame with this function and these bytes behind it.
std::vector<std::uint8_t> frame(const std::vector<std::uint8_t>& pdu) {
  std::vector<std::uint8_t> bytes = {0, 1, 0, 0, 0, static_cast<std::uint8_t>(pdu.size() + 1), 255};
  bytes.insert(bytes.end(), pdu.begin(), pdu.end());
  return bytes;
}

int exception_of(const std::vector<std::uint8_t>& pdu) {
  const auto request = parse_request(frame(pdu));
  return request ? 0 : request.error();
}

TEST(ModbusRequest, FramesAreCutFromTheStream) {
  const auto whole = frame({3, 0, 0, 0, 1});
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_EQ(first_frame(std::span(whole).first(size)).state, FrameState::incomplete) << size;
  }
  auto two = whole;
  two.insert(two.end(), whole.begin(), whole.end());
  const Frame first = first_frame(two);
  EXPECT_EQ(first.state, FrameState::whole);
  EXPECT_EQ(first.size, whole.size());
}

TEST(ModbusRequest, GarbageIsSeenAtOnce) {
  EXPECT_EQ(first_frame(std::vector<std::uint8_t>{'G', 'E', 'T', ' '}).state, FrameState::garbage);
  EXPECT_EQ(first_frame(std::vector<std::uint8_t>{0, 1, 0, 0, 0, 1}).state, FrameState::garbage);
  EXPECT_EQ(first_frame(std::vector<std::uint8_t>{0, 1, 0, 0, 0, 255}).state, FrameState::garbage);
  EXPECT_EQ(first_frame(std::vector<std::uint8_t>{0, 1, 0, 0, 0, 254}).state, FrameState::incomplete);
  EXPECT_EQ(first_frame(frame({0x83, 2})).state, FrameState::garbage) << "no request, but an exception";
}

TEST(ModbusRequest, IsReadWhole) {
  const auto request = parse_request(frame({3, 0x01, 0x02, 0, 5}));
  ASSERT_TRUE(request.has_value());
  EXPECT_EQ(request->kind, RegisterKind::holding_register);
  EXPECT_FALSE(request->writes);
  EXPECT_EQ(request->address, 0x102);
  EXPECT_EQ(request->count, 5);
  const auto written = parse_request(frame({15, 0, 7, 0, 9, 2, 0xff, 1}));
  ASSERT_TRUE(written.has_value());
  EXPECT_EQ(written->kind, RegisterKind::coil);
  EXPECT_TRUE(written->writes);
  EXPECT_EQ(written->count, 9);
}

TEST(ModbusRequest, WritesWhatItSays) {
  const auto words = [](const std::vector<std::uint8_t>& pdu) {
    MapValues values;
    const auto request = parse_request(frame(pdu));
    take_written(frame(pdu), *request, values);
    const auto taken = values.registers(request->count);
    return std::vector<int>(taken.begin(), taken.end());
  };
  const auto bits = [](const std::vector<std::uint8_t>& pdu) {
    MapValues values;
    const auto request = parse_request(frame(pdu));
    take_written(frame(pdu), *request, values);
    const auto taken = values.bits(request->count);
    return std::vector<int>(taken.begin(), taken.end());
  };
  EXPECT_EQ(words({6, 0, 0, 0x12, 0x34}), std::vector{0x1234});
  EXPECT_EQ(words({16, 0, 0, 0, 2, 4, 0xff, 0xfe, 0, 1}), (std::vector{0xfffe, 1}));
  EXPECT_EQ(bits({5, 0, 0, 0xff, 0}), std::vector{1});
  EXPECT_EQ(bits({5, 0, 0, 0, 0}), std::vector{0});
  EXPECT_EQ(bits({15, 0, 0, 0, 9, 2, 0x81, 0xff}), (std::vector{1, 0, 0, 0, 0, 0, 0, 1, 1}));
}

TEST(ModbusRequest, IsRefusedWithTheExceptionOfTheProtocol) {
  EXPECT_EQ(exception_of({7}), 1);
  EXPECT_EQ(exception_of({0x2b, 0x0e, 1, 0}), 1);
  EXPECT_EQ(exception_of({3, 0, 0, 0}), 3);           // too short
  EXPECT_EQ(exception_of({3, 0, 0, 0, 1, 0}), 3);     // too long
  EXPECT_EQ(exception_of({3, 0, 0, 0, 0}), 3);        // no register
  EXPECT_EQ(exception_of({3, 0, 0, 0, 125}), 0);      // the most
  EXPECT_EQ(exception_of({3, 0, 0, 0, 126}), 3);      // more
  EXPECT_EQ(exception_of({1, 0, 0, 0x07, 0xd0}), 0);  // 2000 bits
  EXPECT_EQ(exception_of({1, 0, 0, 0x07, 0xd1}), 3);  // 2001 bits
  EXPECT_EQ(exception_of({3, 0xff, 0xff, 0, 1}), 0);  // the last register
  EXPECT_EQ(exception_of({3, 0xff, 0xff, 0, 2}), 2);  // beyond it
  EXPECT_EQ(exception_of({5, 0, 0, 0xff, 0}), 0);     // on
  EXPECT_EQ(exception_of({5, 0, 0, 0x12, 0x34}), 3);  // neither on nor off
  EXPECT_EQ(exception_of({6, 0, 0, 0x12, 0x34}), 0);  // any value
  EXPECT_EQ(exception_of({16, 0, 0, 0, 1, 2, 9, 9}), 0);
  EXPECT_EQ(exception_of({16, 0, 0, 0, 2, 2, 9, 9}), 3);  // two registers in two bytes
  EXPECT_EQ(exception_of({16, 0, 0, 0, 1, 4, 9, 9}), 3);  // more bytes said than there
  EXPECT_EQ(exception_of({15, 0, 0, 0, 9, 1, 0xff}), 3);  // nine bits in one byte
}

}  // namespace
}  // namespace plchost::modbus
