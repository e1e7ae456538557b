#include "schedulers/tasks/release_grid.hpp"

#include <gtest/gtest.h>

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr TimePoint kGridOrigin{std::chrono::seconds(5)};
constexpr Duration kInterval = milliseconds(10);

TimePoint at(Duration since_origin) {
  return kGridOrigin + since_origin;
}

TEST(ReleaseGrid, BeginsAtItsOrigin) {
  const ReleaseGrid sut(kGridOrigin, kInterval, LatePolicy::next);
  EXPECT_EQ(sut.plan(at(-milliseconds(7))).release, kGridOrigin);
  EXPECT_EQ(sut.plan(kGridOrigin).release, kGridOrigin);
  EXPECT_EQ(sut.plan(kGridOrigin).lost_cycles, 0U);
}

TEST(ReleaseGrid, PlansFromTheReleaseBeforeNotFromNow) {
  ReleaseGrid sut(kGridOrigin, kInterval, LatePolicy::next);
  for (int i = 0; i < 1000; ++i) {
    const TimePoint planned = at(i * kInterval);
    const auto plan = sut.plan(planned - kInterval + milliseconds(i % 9));
    ASSERT_EQ(plan.release, planned);
    sut.ran(plan.release);
  }
}

TEST(ReleaseGrid, GivesTheSameAnswerUntilACycleRan) {
  const ReleaseGrid sut(kGridOrigin, kInterval, LatePolicy::next);
  EXPECT_EQ(sut.plan(at(milliseconds(25))).lost_cycles, 3U);
  EXPECT_EQ(sut.plan(at(milliseconds(25))).lost_cycles, 3U);
}

TEST(ReleaseGrid, NextSkipsWholePeriodsAndStaysOnTheGrid) {
  ReleaseGrid sut(kGridOrigin, kInterval, LatePolicy::next);
  sut.ran(kGridOrigin);
  const auto plan = sut.plan(at(milliseconds(35)));
  EXPECT_EQ(plan.release, at(milliseconds(40)));
  EXPECT_EQ(plan.lost_cycles, 3U);
}

TEST(ReleaseGrid, NextRunsAReleaseThatComesJustWhenTheTaskIsBack) {
  ReleaseGrid sut(kGridOrigin, kInterval, LatePolicy::next);
  sut.ran(kGridOrigin);
  EXPECT_EQ(sut.plan(at(milliseconds(10))).lost_cycles, 0U);
  EXPECT_EQ(sut.plan(at(milliseconds(10))).release, at(milliseconds(10)));
  EXPECT_EQ(sut.plan(at(milliseconds(10) + nanoseconds(1))).release, at(milliseconds(20)));
  EXPECT_EQ(sut.plan(at(milliseconds(10) + nanoseconds(1))).lost_cycles, 1U);
}

TEST(ReleaseGrid, AsapRunsTheLastMissedReleaseAtOnce) {
  ReleaseGrid sut(kGridOrigin, kInterval, LatePolicy::asap);
  sut.ran(kGridOrigin);
  const auto plan = sut.plan(at(milliseconds(35)));
  EXPECT_EQ(plan.release, at(milliseconds(30)));
  EXPECT_EQ(plan.lost_cycles, 2U);
  sut.ran(plan.release);
  EXPECT_EQ(sut.plan(at(milliseconds(36))).release, at(milliseconds(40)));
}

TEST(ReleaseGrid, AsapThatIsNotLateWaitsForItsRelease) {
  const ReleaseGrid sut(kGridOrigin, kInterval, LatePolicy::asap);
  EXPECT_EQ(sut.plan(at(-milliseconds(1))).release, kGridOrigin);
  EXPECT_EQ(sut.plan(at(-milliseconds(1))).lost_cycles, 0U);
}

TEST(ReleaseGrid, RunsAndLossesAddUpToAllReleases) {
  for (const LatePolicy late : {LatePolicy::next, LatePolicy::asap}) {
    ReleaseGrid sut(kGridOrigin, kInterval, late);
    TimePoint ready = kGridOrigin;
    std::uint64_t all = 0;
    for (int i = 1; i < 500; ++i) {
      const auto plan = sut.plan(ready);
      all += plan.lost_cycles + 1;
      ASSERT_EQ(plan.release, at(static_cast<Duration::rep>(all - 1) * kInterval));
      sut.ran(plan.release);
      ready = std::max(ready, plan.release) + nanoseconds((i * 7'919'993LL) % 45'000'000);
    }
  }
}

TEST(ReleaseGrid, TakesTheLongestIntervalAndTheShortest) {
  ReleaseGrid longest(kGridOrigin, kMaxInterval, LatePolicy::next);
  longest.ran(kGridOrigin);
  EXPECT_EQ(longest.plan(at(3 * kMaxInterval)).release, at(3 * kMaxInterval));
  ReleaseGrid shortest(kGridOrigin, nanoseconds(1), LatePolicy::next);
  shortest.ran(kGridOrigin);
  EXPECT_EQ(shortest.plan(at(kMaxInterval)).release, at(kMaxInterval));
}

TEST(ReleaseGrid, NewIntervalBeginsBehindTheReleaseThatIsPlanned) {
  ReleaseGrid sut(kGridOrigin, kInterval, LatePolicy::next);
  sut.ran(kGridOrigin);
  sut.set_interval(nanoseconds(2'500'001));
  EXPECT_EQ(sut.plan(kGridOrigin).release, at(kInterval));
  sut.ran(at(kInterval));
  EXPECT_EQ(sut.plan(at(kInterval)).release, at(kInterval + nanoseconds(2'500'001)));
  EXPECT_EQ(sut.plan(at(2 * kInterval)).lost_cycles, 3U);
  EXPECT_EQ(sut.plan(at(2 * kInterval)).release, at(kInterval + nanoseconds(10'000'004)));
}

}  // namespace
}  // namespace plchost
