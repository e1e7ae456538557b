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

TEST_P(EventTasks, RunForAnEdgeThatIsOverBetweenTwoPollsIfItIsRaisedByCall) {
  begin();
  for (int i = 0; i < 10; ++i) {
    variable = true;  // and FALSE again before anybody looks
    EXPECT_TRUE(set->task(0).raise_event());
    variable = false;
    clock.run_for(milliseconds(1));
  }
  ASSERT_EQ(starts.size(), 10U);
  EXPECT_EQ(starts, grid(starts[0], milliseconds(1), 10)) << "each at the poll after its call";
}

TEST_P(EventTasks, RunOnceForEachCallAndLoseWhatIsBeyondTheBacklog) {
  add(event("on_edge", [this] { return variable.load(); }, [this] { starts.push_back(clock.now()); }));
  ASSERT_TRUE(create());
  SchedulerSettings settings;
  settings.max_event_backlog = 20;
  start(GetParam(), settings);
  for (int i = 0; i < 25; ++i) set->task(0).raise_event();
  clock.run_for(milliseconds(10));
  EXPECT_EQ(starts.size(), 20U);
  EXPECT_EQ(counters(0).lost_events, 5U);
}

TEST_P(EventTasks, CountCallsOnlyFromTheFirstCallOn) {
  begin();
  set_for_a_tick(true);
  set_for_a_tick(false);
  EXPECT_EQ(starts.size(), 1U);
  set->task(0).raise_event();
  for (int i = 0; i < 5; ++i) {
    set_for_a_tick(true);
    set_for_a_tick(false);
  }
  EXPECT_EQ(starts.size(), 2U);
}

TEST_P(EventTasks, KeepWhatWasRaisedThroughSwitchesAndForgetItAtAStart) {
  begin();
  int raised = 0;
  for (const std::string_view other : every_scheduler()) {
    for (int i = 0; i < 3; ++i, ++raised) set->task(0).raise_event();
    ASSERT_TRUE(set->switch_to(other, {}));
    clock.run_for(milliseconds(5));
    EXPECT_EQ(starts.size(), static_cast<std::size_t>(raised)) << other;
  }
  ASSERT_TRUE(set->stop(std::chrono::seconds(10)));
  set->task(0).raise_event();
  start(GetParam());
  clock.run_for(milliseconds(10));
  EXPECT_EQ(starts.size(), static_cast<std::size_t>(raised));
}

// A poll costs one look at each variable, and nothing for those whose edges are raised by call.
TEST_P(EventTasks, EachPollLooksAtEachVariableOnce) {
  constexpr std::size_t kTasks = 500;
  std::atomic<std::uint64_t> looks{0};
  for (std::size_t i = 0; i < kTasks; ++i) {
    add(event("event" + std::to_string(i), [&] { return ++looks == 0; }, [] {}));
  }
  ASSERT_TRUE(create());
  const TimePoint begin = start(GetParam());
  clock.run_until(begin + std::chrono::microseconds(3700));
  const std::uint64_t before = looks;
  clock.run_for(milliseconds(10));
  EXPECT_EQ(looks - before, 10 * kTasks);
  for (std::size_t i = 0; i < kTasks / 2; ++i) set->task(i).raise_event();
  clock.run_for(milliseconds(1));
  const std::uint64_t with_calls = looks;
  clock.run_for(milliseconds(10));
  EXPECT_EQ(looks - with_calls, 10 * kTasks / 2);
}

TEST(TasksOfOtherKinds, HaveNoEventToRaise) {
  ManualTasks tasks;
  tasks.add(ManualTasks::cyclic("main", milliseconds(1), [] {}));
  ASSERT_TRUE(tasks.create());
  EXPECT_FALSE(tasks.set->task(0).raise_event());
}

// All grids begin after the variables were read for the first time.
TEST_P(EventTasks, WhoseVariablesTakeLongToReadMakeNobodyLoseACycleAtTheStart) {
  std::atomic<bool> first_read{true};
  std::atomic<bool> reading{false};
  add(event(
      "on_edge",
      [&] {
        if (first_read.exchange(false)) {
          reading = true;
          clock.spend(milliseconds(50));
        }
        return false;
      },
      [] {}));
  add(cyclic("fast", milliseconds(1), [this] { starts.push_back(clock.now()); }));
  ASSERT_TRUE(create());
  const TimePoint asked = clock.now();
  std::jthread control([this] { start(GetParam()); });
  while (!reading) std::this_thread::yield();
  clock.settle();
  clock.run_until(asked + milliseconds(50));
  control.join();
  clock.run_until(asked + milliseconds(80));
  ASSERT_FALSE(starts.empty());
  EXPECT_EQ(starts, grid(asked + milliseconds(50) + TaskSet::kStartLead, milliseconds(1),
                         static_cast<int>(starts.size())));
  EXPECT_EQ(counters(1).lost_cycles, 0U);
}

INSTANTIATE_TEST_SUITE_P(Each, EventTasks, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
