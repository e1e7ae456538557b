#include "api/client/check_names.hpp"

#include <gmock/gmock.h>

#include "shm/base/names.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

/// The message of an invalid argument; empty: it is good.
std::string refusal(const Result<void>& result) {
  if (result) return "";
  EXPECT_EQ(result.error().code, ErrorCode::invalid_argument);
  return result.error().message;
}

std::string text(std::size_t length) {
  return std::string(length, 'x');
}

TEST(CheckNames, TakesTheLongestAndSaysWhatIsAllowedOneBeyond) {
  EXPECT_EQ(refusal(check_host_name(text(kMaxHostName))), "");
  EXPECT_THAT(refusal(check_host_name(text(kMaxHostName + 1))), HasSubstr("1 to 63"));
  EXPECT_EQ(refusal(check_event_name(text(kMaxInstanceName), text(kMaxEventName))), "");
  EXPECT_THAT(refusal(check_event_name(text(kMaxInstanceName + 1), "e")), HasSubstr("1 to 31"));
  EXPECT_THAT(refusal(check_event_name("i", text(kMaxEventName + 1))), HasSubstr("1 to 50"));
  EXPECT_EQ(refusal(check_task_name(text(kMaxInstanceName), text(kMaxTaskName))), "");
  EXPECT_THAT(refusal(check_task_name(text(kMaxInstanceName + 1), "t")), HasSubstr("1 to 31"));
  EXPECT_THAT(refusal(check_task_name("i", text(kMaxTaskName + 1))), HasSubstr("1 to 50"));
}

TEST(CheckNames, TakesRequestsUpToTheBoundOfEachField) {
  EXPECT_EQ(refusal(check_api_request({text(kMaxHostName), 1, text(kMaxInstanceName), text(kMaxArgument)})),
            "");
  EXPECT_THAT(refusal(check_api_request({text(kMaxHostName + 1), 1, "i", ""})), HasSubstr("1 to 63"));
  EXPECT_THAT(refusal(check_api_request({"h", 1, text(kMaxInstanceName + 1), ""})), HasSubstr("1 to 31"));
  EXPECT_THAT(refusal(check_api_request({"h", 1, "i", text(kMaxArgument + 1)})), HasSubstr("up to 1535"));
}

TEST(CheckNames, TakesARequestForTheWholeHost) {
  EXPECT_EQ(refusal(check_api_request({"h", plc_OPERATION_CHECK_HOST, "", ""})), "");
}

// A partition of DDS may be a pattern: a post to the host '*' would reach all.
TEST(CheckNames, RefusesPatternsAndZeroesWithinAText) {
  EXPECT_THAT(refusal(check_host_name("*")), HasSubstr("'*'"));
  EXPECT_THAT(refusal(check_event_name("line1", std::string("a\0b", 3))), HasSubstr("allowed"));
  EXPECT_THAT(refusal(check_api_request({"h", 1, "i", std::string("a\0b", 3)})), HasSubstr("zero"));
}

}  // namespace
}  // namespace plchost
