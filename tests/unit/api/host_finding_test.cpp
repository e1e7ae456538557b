#include "api/control/host_finding.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "shm/sockets/control_message.hpp"
#include "shm/sockets/packet_socket.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

HostFinding finding(std::string id) {
  return {std::move(id), FindingLevel::warning, "core 1", "found \"x\"", "why", "advice"};
}

TEST(HostFinding, SurvivesTheRoundTrip) {
  const std::vector all{finding("a"), finding("b")};
  const auto part = decode_part(encode_part(7, all, 0, 4000));
  ASSERT_TRUE(part) << part.error().message;
  EXPECT_EQ(part->check, 7U);
  EXPECT_EQ(part->total, 2U);
  ASSERT_EQ(part->findings.size(), 2U);
  EXPECT_EQ(part->findings[1].id, "b");
  EXPECT_EQ(part->findings[1].level, FindingLevel::warning);
  EXPECT_EQ(part->findings[1].subject, "core 1");
  EXPECT_EQ(part->findings[1].found, "found \"x\"");
  EXPECT_EQ(part->findings[1].why, "why");
  EXPECT_EQ(part->findings[1].advice, "advice");
}

TEST(HostFinding, GoesInPartsThatFitIntoPacketsHoweverLongTheTexts) {
  std::vector<HostFinding> all;
  for (std::size_t i = 0; i < kMaxFindings; ++i) {
    // Quotes and bytes that are not UTF-8 grow when they are written, twice over inside a reply.
    all.push_back({fmt::format("check_{}", i), FindingLevel::note, std::string(300, '"'),
                   std::string(2000, '"'), std::string(2000, '\xff'), std::string(2000, '\n')});
  }
  std::vector<HostFinding> received;
  while (received.size() < all.size()) {
    const auto reply = encode(ControlReply{
        .number = UINT64_MAX, .code = ErrorCode::ok, .text = encode_part(1, all, received.size(), 12000)});
    ASSERT_LE(reply.size(), kMaxPacket);
    const auto part = decode_part(decode_reply(reply)->text);
    ASSERT_TRUE(part) << part.error().message;
    ASSERT_EQ(part->first, received.size());
    ASSERT_FALSE(part->findings.empty());
    received.insert(received.end(), part->findings.begin(), part->findings.end());
  }
  EXPECT_EQ(received.back().id, "check_63");
  EXPECT_EQ(received.back().found.size(), kMaxFindingFound);
}

TEST(HostFinding, HasAnEmptyLastPart) {
  const std::vector all{finding("a")};
  const auto part = decode_part(encode_part(1, all, 1, 100));
  ASSERT_TRUE(part);
  EXPECT_TRUE(part->findings.empty());
}

class BadFindings : public testing::TestWithParam<const char*> {};

TEST_P(BadFindings, AreRefused) {
  const auto part = decode_part(GetParam());
  ASSERT_FALSE(part);
  EXPECT_EQ(part.error().code, ErrorCode::corrupt);
}

INSTANTIATE_TEST_SUITE_P(
    HostFinding, BadFindings,
    testing::Values("", "[]", "{}", R"({"check":1,"total":65,"first":0,"findings":[]})",
                    R"({"check":1,"total":1,"first":1,"findings":[{}]})",
                    R"({"check":-1,"total":1,"first":0,"findings":[]})",
                    R"({"check":1,"total":1,"first":0,"findings":{}})",
                    R"({"check":1,"total":1,"first":0,"findings":[7]})",
                    R"({"check":1,"total":1,"first":0,"findings":[{"level":0,"id":"a"}]})",
                    R"({"check":1,"total":1,"first":0,"findings":[
                       {"level":4,"id":"a","subject":"","found":"","why":"","advice":""}]})",
                    R"({"check":1,"total":1,"first":0,"findings":[
                       {"level":1,"id":"","subject":"","found":"","why":"","advice":""}]})"));

TEST(HostFinding, ReadsWithWhichFindingAPartBegins) {
  EXPECT_EQ(parse_first_finding("15").value(), 15U);
  for (const char* wrong : {"", "-1", "65", "1x", " 1", "99999999999999999999"}) {
    EXPECT_FALSE(parse_first_finding(wrong)) << wrong;
  }
}

}  // namespace
}  // namespace plchost
