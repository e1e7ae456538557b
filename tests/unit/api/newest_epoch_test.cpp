#include "api/client/newest_epoch.hpp"

#include <gtest/gtest.h>

namespace plchost {
namespace {

using std::chrono::milliseconds;

constexpr TimePoint kStart{std::chrono::seconds(1000)};

TEST(NewestEpoch, IsThatOfTheServerThatCameLast) {
  NewestEpoch sut;
  EXPECT_TRUE(sut.accept(7, kStart));
  EXPECT_TRUE(sut.accept(9, kStart));
  EXPECT_EQ(sut.value(), 9U);
}

TEST(NewestEpoch, IsNotThatOfALateLastWord) {
  NewestEpoch sut;
  EXPECT_TRUE(sut.accept(9, kStart));
  EXPECT_FALSE(sut.accept(7, kStart + kServerGone));
  EXPECT_TRUE(sut.accept(9, kStart + kServerGone));
  EXPECT_FALSE(sut.accept(7, kStart + 2 * kServerGone)) << "the newer one goes on";
  EXPECT_EQ(sut.value(), 9U);
}

TEST(NewestEpoch, IsThatOfAServerWhoseClockWasSetBackOnceTheOtherIsGone) {
  NewestEpoch sut;
  EXPECT_TRUE(sut.accept(9, kStart));
  EXPECT_FALSE(sut.accept(7, kStart + milliseconds(200)));
  EXPECT_TRUE(sut.accept(7, kStart + kServerGone + milliseconds(1)));
  EXPECT_TRUE(sut.accept(7, kStart + kServerGone + milliseconds(2)));
  EXPECT_EQ(sut.value(), 7U);
}

}  // namespace
}  // namespace plchost
