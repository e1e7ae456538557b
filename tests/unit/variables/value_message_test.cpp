#include "shm/variables/value_message.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace plchost {
namespace {

ValueRequest request_of(std::size_t elements) {
  ValueRequest request{.number = 5, .stream = 99, .kind = ValueKind::current, .elements = {}};
  for (std::size_t i = 0; i < elements; ++i)
    request.elements.push_back({.symbol = static_cast<std::uint32_t>(i), .element = 3});
  return request;
}

ValueReply reply_of(std::size_t elements, std::size_t bytes) {
  ValueReply reply{.number = 5,
                   .code = ErrorCode::ok,
                   .consistent = true,
                   .time_unix_ns = 1,
                   .time_monotonic_ns = 2,
                   .elements = request_of(elements).elements,
                   .forced = std::vector<std::uint8_t>(elements, 1),
                   .values = {}};
  for (std::size_t i = 0; i < bytes; ++i) reply.values.push_back(std::byte(i % 251));
  return reply;
}

void expect_same(const ValueReply& one, const ValueReply& other) {
  EXPECT_EQ(one.number, other.number);
  EXPECT_EQ(one.code, other.code);
  EXPECT_EQ(one.consistent, other.consistent);
  EXPECT_EQ(one.time_unix_ns, other.time_unix_ns);
  EXPECT_EQ(one.time_monotonic_ns, other.time_monotonic_ns);
  EXPECT_EQ(one.elements, other.elements);
  EXPECT_EQ(one.forced, other.forced);
  EXPECT_EQ(one.values, other.values);
}

TEST(ValueMessage, RequestsComeBackTheSame) {
  for (const std::size_t elements : {std::size_t{0}, std::size_t{1}, kMaxRequestedValues}) {
    const std::string packet = encode(request_of(elements));
    EXPECT_LE(packet.size(), kMaxPacket);
    const auto request = decode_value_request(packet);
    ASSERT_TRUE(request);
    EXPECT_EQ(request->number, 5);
    EXPECT_EQ(request->stream, 99);
    EXPECT_EQ(request->kind, ValueKind::current);
    EXPECT_EQ(request->elements, request_of(elements).elements);
  }
}

TEST(ValueMessage, OtherRequestsAreRefused) {
  EXPECT_FALSE(decode_value_request(encode(request_of(kMaxRequestedValues + 1))));
  const std::string good = encode(request_of(2));
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_EQ(decode_value_request(good.substr(0, size)).error().code, ErrorCode::corrupt);
  EXPECT_FALSE(decode_value_request(good + "x"));
  for (const std::size_t byte : {std::size_t{0}, std::size_t{4}, std::size_t{24}}) {
    std::string bad = good;
    bad[byte] = '\x77';
    EXPECT_FALSE(decode_value_request(bad)) << byte;
  }
}

TEST(ValueMessage, RepliesComeBackInSeveralPackets) {
  ValueReplyReader reader;
  for (const auto& [elements, bytes] :
       {std::pair{std::size_t{0}, std::size_t{0}}, std::pair{std::size_t{3}, std::size_t{12}},
        std::pair{kMaxRequestedValues, kMaxValueBytes}}) {
    const ValueReply sent = reply_of(elements, bytes);
    const auto packets = encode(sent);
    EXPECT_EQ(packets.size(), bytes == kMaxValueBytes ? 7 : 1);
    for (std::size_t i = 0; i < packets.size(); ++i) {
      EXPECT_LE(packets[i].size(), kMaxPacket);
      const auto got = reader.take(packets[i]);
      ASSERT_TRUE(got);
      ASSERT_EQ(got->has_value(), i + 1 == packets.size());
      if (*got) expect_same(**got, sent);
    }
  }
}

TEST(ValueMessage, PacketsThatCannotFollowAreRefused) {
  const auto packets = encode(reply_of(kMaxRequestedValues, kMaxValueBytes));
  EXPECT_FALSE(ValueReplyReader().take(packets[1]));
  {
    ValueReplyReader reader;
    ASSERT_TRUE(reader.take(packets[0]));
    EXPECT_FALSE(reader.take(packets[0]));
  }
  {
    ValueReplyReader reader;
    ASSERT_TRUE(reader.take(packets[0]));
    EXPECT_FALSE(reader.take(packets[2]));
  }
  const std::string good = encode(reply_of(2, 4)).at(0);
  for (std::size_t size = 0; size < 16; ++size) EXPECT_FALSE(ValueReplyReader().take(good.substr(0, size)));
  EXPECT_FALSE(ValueReplyReader().take(good + "x"));
  std::string bad = good;
  bad[16 + 24] = 3;  // more elements than there are
  EXPECT_FALSE(ValueReplyReader().take(bad));
  bad = good;
  bad[16 + 32] = 15;  // a code that does not exist
  EXPECT_FALSE(ValueReplyReader().take(bad));
}

}  // namespace
}  // namespace plchost
