#include "tests/conformance/scheduler_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

class EventTasks : public testing::TestWithParam<std::string_view>, public ManualTasks {
 protected:
  void TearDown() override { finish(); }

  void begin(Duration execution = Duration::zero()) {
    add(event(
        "on_edge", [this] { return variable.load(); },
        [this, execution] {
          starts.push_back(clock.now());
          clock.spend(execution);
        }));
    ASSERT_TRUE(create());
    origin = start(GetParam());
    clock.run_until(origin);
  }
  // Sets the variable for one poll.
  void set_for_a_tick(bool level) {
    variable = level;
    clock.run_for(milliseconds(1));
  }

  std::atomic<bool> variable{false};
  Starts starts;
  TimePoint origin;
};

TEST_P(EventTasks, RunOnceForEachRisingEdge) {
  begin();
  for (int i = 0; i < 20; ++i) {
    set_for_a_tick(true);
    set_for_a_tick(true);
    set_for_a_tick(false);
  }
  // Where between two ticks the poll lies is the scheduler's choice.
  ASSERT_FALSE(starts.empty());
  EXPECT_GT(starts[0], origin);
  EXPECT_LE(starts[0], origin + milliseconds(1));
  EXPECT_EQ(starts, grid(starts[0], milliseconds(3), 20));
  EXPECT_EQ(counters(0).lost_events, 0U);
}

TEST_P(EventTasks, SeeNoEdgeInALevelThatIsTrueAtTheStart) {
  variable = true;
  begin();
  clock.run_for(milliseconds(10));
  EXPECT_TRUE(starts.empty());
  set_for_a_tick(false);
  set_for_a_tick(true);
  EXPECT_EQ(starts.size(), 1U);
}

TEST_P(EventTasks, KeepOneRunWhileTheyAreBusyAndCountMoreAsLost) {
  begin(milliseconds(20));
  set_for_a_tick(true);  // runs for 20 ms
  for (int i = 0; i < 5; ++i) {
    set_for_a_tick(false);
    set_for_a_tick(true);
  }
  clock.run_for(milliseconds(100));
  ASSERT_EQ(starts.size(), 2U);
  EXPECT_EQ(starts[1], starts[0] + milliseconds(20));
  EXPECT_EQ(counters(0).lost_events, 4U);
}

TEST_P(EventTasks, ArePolledAtTheSchedulerInterval) {
  add(event("on_edge", [this] { return variable.load(); }, [this] { starts.push_back(clock.now()); }));
  ASSERT_TRUE(create());
  SchedulerSettings settings;
  settings.scheduler_interval = milliseconds(10);
  origin = start(GetParam(), settings);
  clock.run_until(origin + milliseconds(1));
  variable = true;
  clock.run_for(milliseconds(30));
  ASSERT_EQ(starts.size(), 1U);
  EXPECT_GT(starts[0], origin + milliseconds(1));
  EXPECT_LE(starts[0], origin + milliseconds(11));
  // All polls lie on one grid: the next edge is seen whole intervals later.
  variable = false;
  clock.run_for(milliseconds(20));
  variable = true;
  clock.run_for(milliseconds(20));
  ASSERT_EQ(starts.size(), 2U);
  EXPECT_EQ((starts[1] - starts[0]) % milliseconds(10), Duration::zero());
}

TEST_P(EventTasks, DoNotRunForEdgesWhileTheyWereStopped) {
  begin();
  ASSERT_TRUE(set->stop(std::chrono::seconds(10)));
  variable = true;
  clock.run_for(milliseconds(5));
  start(GetParam());
  clock.run_for(milliseconds(10));
  EXPECT_TRUE(starts.empty());
}

TEST_P(EventTasks, KeepAnEdgeThatRisesJustBeforeASwitch) {
  begin();
  for (const std::string_view other : every_scheduler()) {
    starts.clear();
    set_for_a_tick(false);
    variable = true;
    ASSERT_TRUE(set->switch_to(other, {}));
    clock.run_for(milliseconds(5));
    EXPECT_EQ(starts.size(), 1U) << other;
  }
}

TEST_P(EventTasks, SeeNoEdgeInALevelThatIsHeldThroughASwitch) {
  begin();
  set_for_a_tick(true);
  for (const std::string_view other : every_scheduler()) {
    ASSERT_TRUE(set->switch_to(other, {}));
    clock.run_for(milliseconds(5));
  }
  EXPECT_EQ(starts.size(), 1U);
}

TEST_P(EventTasks, KeepTheRunThatIsDueThroughASwitchDuringTheirCycle) {
  begin(milliseconds(20));
  set_for_a_tick(true);
  set_for_a_tick(false);
  set_for_a_tick(true);  // due after the cycle that runs
  EXPECT_TRUE(set->switch_to("CmpSchedule", {}));
  clock.run_for(milliseconds(100));
  EXPECT_EQ(starts.size(), 2U);
  EXPECT_EQ(counters(0).lost_events, 0U);
}

INSTANTIATE_TEST_SUITE_P(Each, EventTasks, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
