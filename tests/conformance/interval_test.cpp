// The interval of a cyclic task is set while it runs.
#include "tests/conformance/scheduler_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

class RuntimeInterval : public testing::TestWithParam<std::string_view>, public ManualTasks {
 protected:
  void TearDown() override { finish(); }

  // The tick is as fine as the intervals here, so that it hides nothing.
  static SchedulerSettings settings() {
    SchedulerSettings fine;
    fine.scheduler_interval = microseconds(500);
    return fine;
  }

  Starts starts;
};

TEST_P(RuntimeInterval, SetInACyclePlacesTheReleaseThatFollows) {
  const std::vector<Duration> intervals{milliseconds(2), milliseconds(5), microseconds(1500),
                                        milliseconds(1)};
  Starts expected;
  add(cyclic("main", milliseconds(1), [&] {
    starts.push_back(clock.now());
    ASSERT_TRUE(set->task(0).set_interval(intervals[starts.size() % intervals.size()]));
  }));
  ASSERT_TRUE(create());
  TimePoint planned = start(GetParam(), settings());
  for (std::size_t i = 1; i <= 40; ++i) {
    expected.push_back(planned);
    planned += intervals[i % intervals.size()];
  }
  clock.run_until(expected.back());
  EXPECT_EQ(starts, expected);
  EXPECT_EQ(counters(0).lost_cycles, 0U);
  EXPECT_EQ(counters(0).jitter_max_ns, 0);
}

TEST_P(RuntimeInterval, SetByOthersLeavesTheReleaseThatIsPlanned) {
  add(cyclic("main", milliseconds(4), [&] { starts.push_back(clock.now()); }));
  ASSERT_TRUE(create());
  const TimePoint origin = start(GetParam(), settings());
  clock.run_until(origin + milliseconds(5));
  ASSERT_TRUE(set->task(0).set_interval(milliseconds(1)));
  clock.run_until(origin + milliseconds(10));
  const auto at = [&](int ms) { return origin + milliseconds(ms); };
  EXPECT_EQ(starts, (Starts{at(0), at(4), at(8), at(9), at(10)}));
  EXPECT_EQ(counters(0).interval_ns, 1'000'000);
}

TEST_P(RuntimeInterval, HoldsAcrossAnExchangeOfTheScheduler) {
  add(cyclic("main", milliseconds(4), [&] { starts.push_back(clock.now()); }));
  ASSERT_TRUE(create());
  const TimePoint origin = start(GetParam(), settings());
  ASSERT_TRUE(set->task(0).set_interval(milliseconds(3)));
  clock.run_until(origin + milliseconds(1));
  for (const std::string_view other : every_scheduler()) {
    ASSERT_TRUE(set->switch_to(other, settings()));
    clock.run_for(milliseconds(6));
  }
  EXPECT_EQ(starts, grid(origin, milliseconds(3), static_cast<int>(starts.size())));
  EXPECT_EQ(counters(0).cycles, 7U);
}

INSTANTIATE_TEST_SUITE_P(Each, RuntimeInterval, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
