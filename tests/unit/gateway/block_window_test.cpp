#include "api/gateway/block_window.hpp"

#include <gtest/gtest.h>

namespace plchost {
namespace {

constexpr TimePoint kStart = TimePoint(std::chrono::hours(1));

TEST(BlockWindow, NumbersBlocksFromOneWithoutAGap) {
  BlockWindow sut;
  EXPECT_EQ(sut.next(), 1U);
  sut.add(10, kStart);
  sut.add(10, kStart);
  EXPECT_EQ(sut.next(), 3U);
  EXPECT_TRUE(sut.acknowledge(1, kStart));
  EXPECT_EQ(sut.next(), 3U);
  EXPECT_EQ(sut.under_way(), 1U);
}

TEST(BlockWindow, IsFullAtItsBoundOfBlocksUntilOneIsAcknowledged) {
  BlockWindow sut;
  for (std::size_t i = 0; i < BlockWindow::kMostBlocks; ++i) {
    ASSERT_TRUE(sut.has_room(0)) << i;
    sut.add(0, kStart);
  }
  EXPECT_FALSE(sut.has_room(0));
  sut.acknowledge(1, kStart);
  EXPECT_TRUE(sut.has_room(0));
}

TEST(BlockWindow, IsFullAtItsBoundOfBytes) {
  BlockWindow sut;
  sut.add(BlockWindow::kMostBytes - 10, kStart);
  EXPECT_TRUE(sut.has_room(10));
  EXPECT_FALSE(sut.has_room(11));
}

TEST(BlockWindow, IgnoresAcknowledgementsThatCannotBe) {
  BlockWindow sut;
  sut.add(10, kStart);
  EXPECT_FALSE(sut.acknowledge(2, kStart));
  EXPECT_FALSE(sut.acknowledge(~std::uint64_t{0}, kStart));
  EXPECT_EQ(sut.under_way(), 1U);
  EXPECT_TRUE(sut.acknowledge(1, kStart));
  EXPECT_FALSE(sut.acknowledge(1, kStart)) << "no news";
  EXPECT_FALSE(sut.acknowledge(0, kStart));
}

TEST(BlockWindow, IsStalledWhenNothingIsAcknowledgedForItsPatience) {
  constexpr Duration kLittle = std::chrono::milliseconds(1);
  BlockWindow sut;
  EXPECT_FALSE(sut.stalled(kStart + 10 * BlockWindow::kPatience)) << "nothing is under way";
  sut.add(10, kStart);
  sut.add(10, kStart + kLittle);
  EXPECT_FALSE(sut.stalled(kStart + BlockWindow::kPatience));
  EXPECT_TRUE(sut.stalled(kStart + BlockWindow::kPatience + kLittle));
  sut.acknowledge(1, kStart + BlockWindow::kPatience);
  EXPECT_FALSE(sut.stalled(kStart + BlockWindow::kPatience + kLittle)) << "it goes on";
  sut.be_patient(kStart + 5 * BlockWindow::kPatience);
  EXPECT_FALSE(sut.stalled(kStart + 6 * BlockWindow::kPatience));
}

}  // namespace
}  // namespace plchost
