#include "api/client/newest_epoch.hpp"

#include <gtest/gtest.h>

namespace plchost {
namespace {

using std::chrono::milliseconds;

constexpr TimePoint kEarlier{std::chrono::seconds(1000)};

TEST(NewestEpoch, IsThatOfTheServerThatCameLast) {
  NewestEpoch sut;
  EXPECT_TRUE(sut.accept(7, kEarlier));
  EXPECT_TRUE(sut.accept(9, kEarlier));
  EXPECT_EQ(sut.value(), 9U);
}

TEST(NewestEpoch, IsNotThatOfALateLastWord) {
  NewestEpoch sut;
  EXPECT_TRUE(sut.accept(9, kEarlier));
  EXPECT_FALSE(sut.accept(7, kEarlier + kServerGone));
  EXPECT_TRUE(sut.accept(9, kEarlier + kServerGone));
  EXPECT_FALSE(sut.accept(7, kEarlier + 2 * kServerGone)) << "the newer one goes on";
  EXPECT_EQ(sut.value(), 9U);
}

TEST(NewestEpoch, IsThatOfAServerWhoseClockWasSetBackOnceTheOtherIsGone) {
  NewestEpoch sut;
  EXPECT_TRUE(sut.accept(9, kEarlier));
  EXPECT_FALSE(sut.accept(7, kEarlier + milliseconds(200)));
  EXPECT_TRUE(sut.accept(7, kEarlier + kServerGone + milliseconds(1)));
  EXPECT_TRUE(sut.accept(7, kEarlier + kServerGone + milliseconds(2)));
  EXPECT_EQ(sut.value(), 7U);
}

}  // namespace
}  // namespace plchost
