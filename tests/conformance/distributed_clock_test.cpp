// The grids of cyclic tasks follow a reference clock where the scheduler can move releases, and nowhere else.
#include "tests/conformance/scheduler_fixture.hpp"
#include "tests/support/simulated_reference.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr double kPpm = 1e-6;

class ReferenceClock : public testing::TestWithParam<std::string_view>, public ManualTasks {
 protected:
  void SetUp() override {
    // The fieldbus: it stamps both clocks in its own cycle, and its task is the one that is looked at.
    add(cyclic("bus", milliseconds(1), [this] {
      const TimePoint now = clock.now();
      if (!starts.empty()) steps.push_back(now - starts.back());
      starts.push_back(now);
      record.write(reference.stamp(now));
    }));
    add(cyclic("slow", milliseconds(4), [this] { slow_starts.push_back(clock.now()); }));
    ASSERT_TRUE(create());
    ASSERT_TRUE(set->distributed_clock().use_source(&record));
  }
  void TearDown() override { finish(); }

  [[nodiscard]] ClockStatus status() { return set->distributed_clock().status(*set->task(0).follower()); }
  [[nodiscard]] double deviation_ns() const { return reference.deviation_ns(starts.back(), milliseconds(1)); }
  static bool moves_releases(std::string_view scheduler) { return scheduler == "CmpScheduleOneShot"; }

  SimulatedReference reference{TimePoint(microseconds(1'000'000'300)), 100 * kPpm, 200};
  FakeRecord record;
  Starts starts;
  Starts slow_starts;
  std::vector<Duration> steps;
};

TEST_P(ReferenceClock, IsFollowedOrOnlyMeasured) {
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(1500));
  EXPECT_NEAR(static_cast<double>(status().drift_ppb), 100'000, 2000);
  if (moves_releases(GetParam())) {
    EXPECT_EQ(status().state, ClockState::locked);
    EXPECT_LT(std::abs(deviation_ns()), 150);
    EXPECT_LT(std::abs(reference.deviation_ns(slow_starts.back(), milliseconds(4))), 150);
  } else {
    EXPECT_EQ(status().state, ClockState::measuring);
    EXPECT_EQ(starts, grid(origin, milliseconds(1), static_cast<int>(starts.size())))
        << "its grid is not touched";
  }
  EXPECT_EQ(counters(0).lost_cycles, 0U);
}

TEST_P(ReferenceClock, NoReleaseIsMovedByMoreThanOnePercent) {
  const TimePoint origin = start(GetParam());
  for (int i = 0; i < 10; ++i) {
    clock.run_for(milliseconds(100));
    reference.step(microseconds(i * 173 - 400));
    reference.set_drift((i % 5 - 2) * 90 * kPpm, clock.now());
  }
  clock.run_until(origin + milliseconds(1200));
  for (const Duration step : steps) {
    ASSERT_LE(step, milliseconds(1) + microseconds(10));
    ASSERT_GE(step, milliseconds(1) - microseconds(10));
  }
}

TEST_P(ReferenceClock, GridIsKeptOverAnExchangeOfTheScheduler) {
  start("CmpScheduleOneShot");
  clock.run_for(milliseconds(1000));
  ASSERT_EQ(status().state, ClockState::locked);
  const TimePoint before = starts.back();
  ASSERT_TRUE(set->switch_to(GetParam(), {}));
  clock.run_for(milliseconds(100));
  const TimePoint planned(Duration(counters(0).release_ns));
  const double periods = static_cast<double>((planned - before).count()) / (1e6 * (1 - 100 * kPpm));
  EXPECT_NEAR(periods, std::round(periods), moves_releases(GetParam()) ? 0.001 : 0.02);
  EXPECT_EQ(status().state, moves_releases(GetParam()) ? ClockState::locked : ClockState::measuring);
  ASSERT_TRUE(set->switch_to("CmpScheduleOneShot", {}));
  clock.run_for(milliseconds(300));
  EXPECT_EQ(status().state, ClockState::locked);
  for (const Duration step : steps) ASSERT_LE(step, milliseconds(2) + microseconds(10));
}

TEST_P(ReferenceClock, LateWakeUpsDoNotMoveThePlan) {
  clock.set_wake_latency(microseconds(40));
  SchedulerSettings settings;
  settings.spin_ahead_max = Duration::zero();
  start(GetParam(), settings);
  clock.run_for(milliseconds(2000));
  if (!moves_releases(GetParam())) return;
  const TimePoint planned(Duration(counters(0).release_ns));
  EXPECT_LT(std::abs(reference.deviation_ns(planned, milliseconds(1))), 150);
  EXPECT_EQ(counters(0).latency_last_ns, 40'000);
}

INSTANTIATE_TEST_SUITE_P(Each, ReferenceClock, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
