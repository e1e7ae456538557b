#include "shm/base/transient.hpp"

#include <gtest/gtest.h>

namespace plchost {
namespace {

TEST(Transient, IsWhatTheHostIsShortOf) {
  for (const int number : {EAGAIN, EMFILE, ENFILE, ENOMEM, ENOBUFS, ENOSPC, EDQUOT, ENOLCK, EINTR}) {
    EXPECT_TRUE(is_transient(failure(ErrorCode::system, "x", number).error())) << number;
  }
  EXPECT_TRUE(is_transient(failure(ErrorCode::busy, "x").error()));
}

TEST(Transient, IsNothingThatSomebodyMustChange) {
  for (const int number : {EACCES, ENOENT, EINVAL, EROFS}) {
    EXPECT_FALSE(is_transient(failure(ErrorCode::system, "x", number).error())) << number;
  }
  EXPECT_FALSE(is_transient(failure(ErrorCode::invalid_argument, "x").error()));
}

}  // namespace
}  // namespace plchost
