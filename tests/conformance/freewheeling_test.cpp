#include <array>

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

  // A cycle that is under way needs the clock to come to its end.
  bool stop_at_the_end_of_a_cycle() {
    (void)set->stop(Duration::zero());
    clock.run_for(milliseconds(20));
    return !set->running();
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

// Others pre-empt it for 7 ms in each cycle: that is not its execution time.
TEST_P(FreewheelingTasks, SleepByTheirOwnExecutionTimeHoweverLongOthersPreEmptThem) {
  struct Way {
    SchedulerSettings settings;
    Duration sleep;
  };
  std::array<Way, 3> ways{Way{{}, milliseconds(1)}, Way{{}, milliseconds(3)}, Way{{}, milliseconds(9)}};
  ways[1].settings.processor_load_maximum = 40;
  ways[2].settings.freewheeling_cycletime = milliseconds(9);
  add(freewheeling("loop", [this] {
    starts.push_back(clock.now());
    clock.spend(milliseconds(2));
    clock.lose_processor(milliseconds(7));
    clock.spend(milliseconds(3));
  }));
  ASSERT_TRUE(create());
  for (const Way& way : ways) {
    starts.clear();
    origin = start(GetParam(), way.settings);
    clock.run_until(origin + milliseconds(100));
    const Duration cycle = milliseconds(2 + 7 + 3) + way.sleep;
    EXPECT_EQ(starts, grid(origin, cycle, static_cast<int>(starts.size())));
    EXPECT_EQ(starts.size(), static_cast<std::size_t>(milliseconds(100) / cycle) + 1);
    EXPECT_EQ(counters(0).exec_last_ns, 12'000'000) << "the statistics show what the clock on the wall shows";
    clock.run_for(milliseconds(3));
    ASSERT_TRUE(stop_at_the_end_of_a_cycle());
  }
}

INSTANTIATE_TEST_SUITE_P(Each, FreewheelingTasks, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
