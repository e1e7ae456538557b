#include "shm/sockets/control_message.hpp"

#include <limits>

#include <gmock/gmock.h>

namespace plchost {
namespace {

using testing::HasSubstr;

class Verb : public testing::TestWithParam<ControlVerb> {};

TEST_P(Verb, SurvivesTheRoundTrip) {
  const ControlRequest request{.number = std::numeric_limits<std::uint64_t>::max(),
                               .verb = GetParam(),
                               .instance = "line1",
                               .argument = "quo\"te\n\\ \xc3\xa4",
                               .options = {{"boot", "yes"}, {"by", "quo\"te"}},
                               .limit_ns = std::numeric_limits<std::int64_t>::max()};
  const auto decoded = decode_request(encode(request));
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(decoded->number, request.number);
  EXPECT_EQ(decoded->verb, request.verb);
  EXPECT_EQ(decoded->instance, request.instance);
  EXPECT_EQ(decoded->argument, request.argument);
  EXPECT_EQ(decoded->options, request.options);
  EXPECT_EQ(decoded->limit_ns, request.limit_ns);
}

INSTANTIATE_TEST_SUITE_P(ControlMessage, Verb,
                         testing::Values(ControlVerb::start, ControlVerb::stop, ControlVerb::reset,
                                         ControlVerb::restart, ControlVerb::load_application,
                                         ControlVerb::download_application, ControlVerb::rollback_application,
                                         ControlVerb::change_application, ControlVerb::set_scheduler,
                                         ControlVerb::register_event, ControlVerb::unregister_event,
                                         ControlVerb::check_host, ControlVerb::reload_host,
                                         ControlVerb::reset_statistics, ControlVerb::shutdown,
                                         ControlVerb::status, ControlVerb::set_log_level));

TEST(ControlMessage, RepliesOfEachCodeSurviveTheRoundTrip) {
  for (unsigned code = 0; code <= static_cast<unsigned>(ErrorCode::corrupt); ++code) {
    const ControlReply reply{.number = 5, .code = static_cast<ErrorCode>(code), .text = "why"};
    const auto decoded = decode_reply(encode(reply));
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->number, 5U);
    EXPECT_EQ(decoded->code, reply.code);
    EXPECT_EQ(decoded->text, "why");
  }
}

TEST(ControlMessage, IsInTimeUntilItsLimitAndWithoutOneAlways) {
  EXPECT_TRUE(check_in_time(100, 100));
  EXPECT_TRUE(check_in_time(0, 100));
  const auto late = check_in_time(100, 2'500'100);
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, ErrorCode::timed_out);
  EXPECT_THAT(late.error().message, HasSubstr("2.5 ms"));
}

TEST(ControlMessage, EncodesBytesThatAreNoText) {
  const auto decoded = decode_request(encode(ControlRequest{.instance = "a", .argument = "\xff\xfe"}));
  ASSERT_TRUE(decoded);
}

class MalformedRequest : public testing::TestWithParam<std::string> {};

TEST_P(MalformedRequest, IsCorrupt) {
  const auto decoded = decode_request(GetParam());
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
  EXPECT_THAT(decoded.error().message, HasSubstr("control message"));
}

INSTANTIATE_TEST_SUITE_P(
    ControlMessage, MalformedRequest,
    testing::Values(
        "", "{", "[]", "null", "7", "\"text\"", "\xff", std::string("\0", 1), "{}", R"({"version":2})",
        R"({"version":1,"number":1,"verb":"start","instance":"a","argument":""})",
        R"({"version":2.0,"number":1,"verb":"start","instance":"a","argument":""})",
        R"({"version":"2","number":1,"verb":"start","instance":"a","argument":""})",
        R"({"version":28446744073709551615,"number":1,"verb":"start","instance":"a","argument":""})",
        R"({"version":2,"number":-1,"verb":"start","instance":"a","argument":""})",
        R"({"version":2,"number":1.5,"verb":"start","instance":"a","argument":""})",
        R"({"version":2,"number":"1","verb":"start","instance":"a","argument":""})",
        R"({"version":2,"verb":"start","instance":"a","argument":""})",
        R"({"version":2,"number":1,"verb":"explode","instance":"a","argument":""})",
        R"({"version":2,"number":1,"verb":7,"instance":"a","argument":""})",
        R"({"version":2,"number":1,"verb":"start","argument":""})",
        R"({"version":2,"number":1,"verb":"start","instance":null,"argument":""})",
        R"({"version":2,"number":1,"verb":"start","instance":"a"})",
        R"({"version":2,"number":1,"verb":"start","instance":"a","argument":[]})",
        R"({"version":2,"number":1,"verb":"start","instance":"a","argument":"","options":[]})",
        R"({"version":2,"number":1,"verb":"start","instance":"a","argument":"","options":{"boot":true}})",
        R"({"version":2,"number":1,"verb":"start","instance":"a","argument":""} trailing)",
        "{\"version\":" + std::string(8000, '[') + std::string(8000, ']') + "}", std::string(16384, '[')));

class MalformedReply : public testing::TestWithParam<std::string> {};

TEST_P(MalformedReply, IsCorrupt) {
  const auto decoded = decode_reply(GetParam());
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
}

INSTANTIATE_TEST_SUITE_P(ControlMessage, MalformedReply,
                         testing::Values("", "{}", R"({"version":2,"number":1})",
                                         R"({"version":2,"number":1,"code":0})",
                                         R"({"version":2,"number":1,"code":0,"text":1})",
                                         R"({"version":2,"number":1,"code":15,"text":""})",
                                         R"({"version":2,"number":1,"code":-1,"text":""})",
                                         R"({"version":2,"number":1,"code":4294967296,"text":""})",
                                         R"({"version":2,"number":1,"code":"0","text":""})",
                                         R"({"version":2,"number":1,"text":""})"));

TEST(ControlMessage, NamesTheVersionThatIsSpoken) {
  const auto decoded = decode_reply(R"({"version":9,"number":1,"code":0,"text":""})");
  ASSERT_FALSE(decoded);
  EXPECT_THAT(decoded.error().message, HasSubstr("version 9; expected is version 2"));
}

TEST(TimeLimit, OfAnyNumberIsOverOrNot) {
  using Limits = std::numeric_limits<std::int64_t>;
  EXPECT_FALSE(check_in_time(Limits::min(), Limits::max()));
  EXPECT_TRUE(check_in_time(Limits::max(), Limits::min()));
}

}  // namespace
}  // namespace plchost
