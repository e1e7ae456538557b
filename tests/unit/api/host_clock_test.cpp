#include "api/client/host_clock.hpp"

#include <gtest/gtest.h>

#include "api/dds/time_limit.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// A host and a client whose clocks have nothing to do with each other.
class HostClockTest : public testing::Test {
 protected:
  static constexpr TimePoint kStart{seconds(1000)};
  static constexpr std::int64_t kAhead = 77'000'000'123;

  /// The host's time at a time of the client's.
  static std::int64_t at_host(TimePoint here) { return here.time_since_epoch().count() + kAhead; }
  static plc_Presence written(TimePoint here, std::uint64_t epoch = 7) {
    plc_Presence presence{};
    presence.epoch = epoch;
    presence.clock_ns = at_host(here);
    return presence;
  }

  HostClock sut_;
};

TEST_F(HostClockTest, LimitsAreNeverLaterAtTheHostHoweverLateItsPresenceIsTaken) {
  const TimePoint deadline = kStart + seconds(3);
  for (const auto delay : {milliseconds(0), milliseconds(1), milliseconds(40), milliseconds(2900)}) {
    HostClock sut;
    sut.take(written(kStart), kStart + delay);
    const auto limit = sut.limit_at(deadline);
    EXPECT_EQ(limit.epoch, 7U);
    EXPECT_LT(limit.clock_ns, at_host(deadline));
    EXPECT_EQ(limit.clock_ns, at_host(deadline - delay - HostClock::kMargin));
  }
}

TEST_F(HostClockTest, TheBestOfTheLastPresencesCounts) {
  sut_.take(written(kStart), kStart + milliseconds(1));
  sut_.take(written(kStart + milliseconds(25)), kStart + milliseconds(90));
  const TimePoint deadline = kStart + seconds(1);
  EXPECT_EQ(sut_.limit_at(deadline).clock_ns, at_host(deadline - milliseconds(1) - HostClock::kMargin));

  const TimePoint later = kStart + milliseconds(2) + HostClock::kWindow;
  sut_.take(written(later - milliseconds(60)), later);
  EXPECT_EQ(sut_.limit_at(deadline).clock_ns, at_host(deadline - milliseconds(60) - HostClock::kMargin))
      << "clocks drift: an older sample does not count";
}

TEST_F(HostClockTest, AnotherServerOfTheHostHasItsOwnClock) {
  sut_.take(written(kStart), kStart);
  plc_Presence other = written(kStart, 8);
  other.clock_ns = 5;
  sut_.take(other, kStart + milliseconds(1));
  EXPECT_EQ(sut_.limit_at(kStart + milliseconds(12)).epoch, 8U);
  EXPECT_EQ(sut_.limit_at(kStart + milliseconds(12)).clock_ns, 5 + Duration(milliseconds(10)).count());
}

TEST_F(HostClockTest, ADeadlineThatNeverComesIsALimitAllTheSame) {
  sut_.take(written(kStart), kStart);
  EXPECT_GT(sut_.limit_at(TimePoint::max()).clock_ns, at_host(kStart + std::chrono::hours(24)));
}

TEST_F(HostClockTest, AHostThatWasNotSeenHasNone) {
  EXPECT_EQ(sut_.epoch(), 0U);
  EXPECT_EQ(dds::timeliness(sut_.limit_at(kStart), 7, 1), dds::Timeliness::unlimited);
}

TEST(Timeliness, IsByTheClockOfTheServerThatWasSeen) {
  const plc_TimeLimit limit{.epoch = 7, .clock_ns = 100};
  EXPECT_EQ(dds::timeliness(limit, 7, 100), dds::Timeliness::in_time);
  EXPECT_EQ(dds::timeliness(limit, 7, 101), dds::Timeliness::late);
  EXPECT_EQ(dds::timeliness(limit, 8, 1), dds::Timeliness::other_epoch);
}

}  // namespace
}  // namespace plchost
