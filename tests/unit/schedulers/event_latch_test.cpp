#include "schedulers/tasks/event_latch.hpp"

#include <gtest/gtest.h>

namespace plchost {
namespace {

class EventLatchTest : public testing::Test {
 protected:
  bool poll(bool level) { return sut.poll(clock, level, TimePoint(Duration(++polls))); }
  // As the task does: true if there is a run to do.
  bool take() { return sut.take().has_value(); }

  LinuxClock clock;
  EventLatch sut;
  int polls = 0;
};

TEST_F(EventLatchTest, SeesEachRisingEdgeOnce) {
  EXPECT_FALSE(poll(false));
  EXPECT_TRUE(poll(true));
  EXPECT_FALSE(poll(true));
  EXPECT_FALSE(poll(false));
  EXPECT_TRUE(poll(true));
}

TEST_F(EventLatchTest, LevelAtTheStartIsNoEdge) {
  sut.prime(true);
  EXPECT_FALSE(poll(true));
  EXPECT_FALSE(poll(false));
  EXPECT_TRUE(poll(true));
}

TEST_F(EventLatchTest, KeepsOneRunAndCountsFurtherEdgesAsLost) {
  for (int i = 0; i < 5; ++i) {
    poll(true);
    poll(false);
  }
  EXPECT_TRUE(take());
  EXPECT_EQ(sut.take_lost(), 4U);
  EXPECT_EQ(sut.take_lost(), 0U);
  EXPECT_FALSE(take());
}

TEST_F(EventLatchTest, TakesBackTheEdgesThatWereLostSince) {
  const auto edges = [this](int count) {
    for (int i = 0; i < count; ++i) {
      poll(true);
      poll(false);
    }
  };
  edges(3);
  const auto before = sut.lost();
  EXPECT_EQ(before, 2U);
  EXPECT_EQ(sut.take_lost_since(before), 0U);
  edges(4);
  EXPECT_EQ(sut.take_lost_since(before), 4U);
  EXPECT_EQ(sut.take_lost(), 2U);
}

TEST_F(EventLatchTest, EdgeDuringARunIsKeptForTheNext) {
  poll(true);
  EXPECT_TRUE(take());
  poll(false);
  poll(true);
  EXPECT_TRUE(take());
  EXPECT_EQ(sut.take_lost(), 0U);
}

TEST_F(EventLatchTest, SaysWhenTheEdgeOfTheRunWasSeen) {
  poll(true);
  poll(false);
  poll(true);  // lost: does not move the time of the first
  EXPECT_EQ(sut.take(), TimePoint(Duration(1)));
}

TEST_F(EventLatchTest, ForgetsWhatWasDueAndTheLevel) {
  sut.prime(false);
  poll(true);
  poll(false);
  poll(true);
  sut.forget();
  EXPECT_FALSE(sut.primed());
  EXPECT_FALSE(take());
  EXPECT_EQ(sut.take_lost(), 0U);
}

TEST_F(EventLatchTest, RaisedEdgesAreAllKeptUpToTheBacklog) {
  EXPECT_FALSE(sut.is_raised());
  for (int i = 0; i < 7; ++i) sut.raise();
  EXPECT_TRUE(sut.is_raised());
  EXPECT_EQ(sut.poll_raised(clock, TimePoint(Duration(1)), 5), 7U);
  EXPECT_EQ(sut.poll_raised(clock, TimePoint(Duration(2)), 5), 0U);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(take());
  EXPECT_FALSE(take());
  EXPECT_EQ(sut.take_lost(), 2U);
  EXPECT_TRUE(sut.is_raised());
}

TEST_F(EventLatchTest, RunsBehindOthersKeepTheTimeOfTheFirst) {
  sut.raise();
  sut.poll_raised(clock, TimePoint(Duration(1)), 10);
  sut.raise();
  sut.poll_raised(clock, TimePoint(Duration(2)), 10);
  EXPECT_EQ(sut.take(), TimePoint(Duration(1)));
  EXPECT_EQ(sut.take(), TimePoint(Duration(1)));
  sut.raise();
  sut.poll_raised(clock, TimePoint(Duration(3)), 10);
  EXPECT_EQ(sut.take(), TimePoint(Duration(3)));
}

TEST_F(EventLatchTest, ForgetsWhatWasRaised) {
  sut.raise();
  sut.forget();
  EXPECT_EQ(sut.poll_raised(clock, TimePoint(Duration(1)), 10), 0U);
  EXPECT_TRUE(sut.is_raised());
}

}  // namespace
}  // namespace plchost
