#include "tests/conformance/scheduler_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

class FreewheelingTasks : public testing::TestWithParam<std::string_view>, public ManualTasks {
 protected:
  void TearDown() override { finish(); }

  void run(Duration execution, const SchedulerSettings& settings) {
    add(freewheeling("loop", [this, execution] {
      starts.push_back(clock.now());
      clock.spend(execution);
    }));
    ASSERT_TRUE(create());
    origin = start(GetParam(), settings);
    clock.run_until(origin + milliseconds(100));
  }

  Starts starts;
  TimePoint origin;
};

TEST_P(FreewheelingTasks, SleepAFifthOfTheirExecutionTime) {
  run(milliseconds(5), {});
  EXPECT_EQ(starts, grid(origin, milliseconds(5 + 1), 17));
}

TEST_P(FreewheelingTasks, SleepWhatTheProcessorLoadMaximumLeaves) {
  SchedulerSettings settings;
  settings.processor_load_maximum = 60;
  run(milliseconds(10), settings);
  EXPECT_EQ(starts, grid(origin, milliseconds(10 + 4), 8));
}

TEST_P(FreewheelingTasks, SleepTheFixedTimeIfOneIsSet) {
  SchedulerSettings settings;
  settings.freewheeling_cycletime = milliseconds(10);
  run(milliseconds(2), settings);
  EXPECT_EQ(starts, grid(origin, milliseconds(2 + 10), 9));
}

TEST_P(FreewheelingTasks, LoseNoCyclesBecauseNothingIsPlanned) {
  run(milliseconds(30), {});
  EXPECT_EQ(counters(0).lost_cycles, 0U);
  EXPECT_EQ(counters(0).jitter_max_ns, 0);
}

TEST_P(FreewheelingTasks, GoOnSleepingTheirShareAfterASwitch) {
  run(milliseconds(5), {});
  for (const std::string_view other : every_scheduler()) {
    ASSERT_TRUE(set->switch_to(other, {}));
    clock.run_for(milliseconds(100));
  }
  EXPECT_EQ(starts, grid(origin, milliseconds(5 + 1), static_cast<int>(starts.size())));
  EXPECT_EQ(starts.size(), 67U);
}

INSTANTIATE_TEST_SUITE_P(Each, FreewheelingTasks, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
