#include "shm/base/result.hpp"

#include <cerrno>

#include <gmock/gmock.h>

#include "shm/base/system_call.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

TEST(CheckErrno, TakesMinusOneForFailure) {
  errno = ENOENT;
  const auto failed = check_errno(-1, "open x");
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().system_errno, ENOENT);
  EXPECT_THAT(failed.error().describe(), HasSubstr("open x: No such file or directory (ENOENT)"));
  EXPECT_EQ(check_errno(5, "open x"), 5);
}

TEST(CheckReturned, TakesTheErrorNumberForFailure) {
  EXPECT_EQ(check_returned(EPERM, "start").error().system_errno, EPERM);
  EXPECT_TRUE(check_returned(0, "start"));
}

TEST(Failure, PutsTheStepBefore) {
  const auto sut = failure_in("load", Error{ErrorCode::full, 0, "no room"});
  EXPECT_EQ(sut.error().message, "load: no room");
  EXPECT_EQ(sut.error().describe(), "load: no room");
}

TEST(ErrorCode, EachHasAName) {
  for (unsigned code = 0; code <= static_cast<unsigned>(ErrorCode::wrong_size); ++code) {
    EXPECT_NE(to_string(static_cast<ErrorCode>(code)), "unknown");
  }
}

}  // namespace
}  // namespace plchost
