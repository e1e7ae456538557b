#include "api/server/posts/core_share.hpp"

#include <ctime>

#include <gmock/gmock.h>

namespace plchost {
namespace {

using std::chrono::microseconds;

TEST(CoreShare, LetsAThreadRunThatLeavesEnoughToOthers) {
  EXPECT_EQ(CoreShare::rest_after(microseconds(1000), microseconds(0)), Duration::zero());
  EXPECT_EQ(CoreShare::rest_after(microseconds(1000), microseconds(900)), Duration::zero());
}

TEST(CoreShare, MakesUpForWhatAThreadHadTooMuch) {
  EXPECT_EQ(CoreShare::rest_after(microseconds(900), microseconds(900)), microseconds(100));
  EXPECT_EQ(CoreShare::rest_after(microseconds(950), microseconds(900)), microseconds(50));
}

TEST(CoreShare, MakesAThreadRestThatAlwaysHasSomethingToDo) {
  CoreShare sut;
  timespec before{};
  timespec after{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &before);
  const TimePoint start = MonotonicClock::now();
  while (MonotonicClock::now() - start < 40 * CoreShare::kWindow) sut.rest_if_due();
  const Duration elapsed = MonotonicClock::now() - start;
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &after);
  const Duration used = std::chrono::seconds(after.tv_sec - before.tv_sec) +
                        std::chrono::nanoseconds(after.tv_nsec - before.tv_nsec);
  EXPECT_LT(used, elapsed * (CoreShare::kPercent + 5) / 100);
}

}  // namespace
}  // namespace plchost
