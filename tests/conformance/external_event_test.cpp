#include "tests/conformance/scheduler_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class ExternalEventTasks : public testing::TestWithParam<std::string_view>, public ManualTasks {
 protected:
  void TearDown() override { finish(); }

  void post(std::string_view name, int count) {
    for (int i = 0; i < count; ++i) event_named(name).post();
  }
  void write_over(std::string_view name, std::uint64_t count) {
    CountedEvent& event = event_named(name);
    reinterpret_cast<std::atomic<std::uint64_t>&>(event).store(count << 16);
    event.nudge();
  }
  std::atomic<bool> entered{false};
  std::atomic<bool> go{false};

  // Nothing more is to come: the thread sleeps on its event again.
  void expect_no_further_cycle(std::size_t task, std::uint64_t cycles) {
    std::this_thread::sleep_for(milliseconds(5));
    EXPECT_EQ(counters(task).cycles, cycles);
  }
};

TEST_P(ExternalEventTasks, RunOnceForEachPost) {
  add(external("on_ready", "ready", [] {}));
  ASSERT_TRUE(create());
  start(GetParam());
  for (int i = 1; i <= 100; ++i) {
    post("ready", i);
    wait_for_cycles(0, static_cast<std::uint64_t>(i * (i + 1) / 2));
  }
  expect_no_further_cycle(0, 5050);
  EXPECT_EQ(counters(0).lost_events, 0U);
}

TEST_P(ExternalEventTasks, NeedNoTick) {
  add(external("on_ready", "ready", [] {}));
  ASSERT_TRUE(create());
  start(GetParam());  // the clock stands still
  post("ready", 3);
  wait_for_cycles(0, 3);
  EXPECT_EQ(counters(0).latency_max_ns, 0);
}

TEST_P(ExternalEventTasks, RunAllOfThemThatNameTheSameEvent) {
  for (int i = 0; i < 3; ++i) add(external("task" + std::to_string(i), "ready", [] {}));
  add(external("other", "stop", [] {}));
  ASSERT_TRUE(create());
  start(GetParam());
  post("ready", 50);
  for (std::size_t i = 0; i < 3; ++i) wait_for_cycles(i, 50);
  for (std::size_t i = 0; i < 3; ++i) expect_no_further_cycle(i, 50);
  EXPECT_EQ(counters(3).cycles, 0U);
}

TEST_P(ExternalEventTasks, AreBoundByNameBeforeAnybodyElseKnowsTheEvent) {
  add(external("on_late", "late", [] {}));
  ASSERT_TRUE(create());
  start(GetParam());
  CountedEvent& found_later = event_named("late");
  found_later.post();
  wait_for_cycles(0, 1);
}

TEST_P(ExternalEventTasks, AreRefusedIfTheEventCannotBeHad) {
  TaskEnvironment environment;
  environment.allow_unprivileged = true;
  TaskStatistics statistics{};
  environment.statistics = [&](std::size_t) -> TaskStatistics& { return statistics; };
  environment.find_event = [](std::string_view) -> Result<CountedEvent*> {
    return failure(ErrorCode::full, "the pool has no room");
  };
  const auto made =
      TaskSet::create(clock, PriorityBand::normal, {external("on_ready", "ready", [] {})}, environment);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::full);
  EXPECT_THAT(made.error().message, testing::HasSubstr("on_ready"));
}

TEST_P(ExternalEventTasks, BacklogUpToItsBoundIsRunAndWhatIsBeyondIsCountedAsLost) {
  add(external("slow", "ready", [this] {
    entered = true;
    while (!go) std::this_thread::yield();
  }));
  ASSERT_TRUE(create());
  SchedulerSettings settings;
  settings.max_event_backlog = 10;
  start(GetParam(), settings);
  post("ready", 1);
  while (!entered) std::this_thread::yield();
  post("ready", 25);
  go = true;
  wait_for_cycles(0, 11);
  expect_no_further_cycle(0, 11);
  EXPECT_EQ(counters(0).lost_events, 15U);
}

TEST_P(ExternalEventTasks, ACountThatAStrangerWroteOverIsOneRunAndCountedAsLost) {
  add(external("on_ready", "ready", [] {}));
  ASSERT_TRUE(create());
  SchedulerSettings settings;
  settings.max_event_backlog = 10;
  start(GetParam(), settings);
  for (int i = 1; i <= 100; ++i) {
    post("ready", 1);
    wait_for_cycles(0, static_cast<std::uint64_t>(i));
  }
  write_over("ready", 1'000'000);
  wait_for_cycles(0, 101);
  EXPECT_EQ(counters(0).lost_events, 1'000'000U - 100 - 1);
  write_over("ready", 3);
  wait_for_cycles(0, 102);
  EXPECT_EQ(counters(0).lost_events, 1'000'000U - 100);
  post("ready", 1);
  wait_for_cycles(0, 103);
  expect_no_further_cycle(0, 103);
}

TEST_P(ExternalEventTasks, PostsWhileTheyWereStoppedAreNotRun) {
  add(external("on_ready", "ready", [] {}));
  ASSERT_TRUE(create());
  post("ready", 7);
  start(GetParam());
  post("ready", 1);
  wait_for_cycles(0, 1);
  ASSERT_TRUE(set->stop(seconds(10)));
  post("ready", 9);
  start(GetParam());
  post("ready", 2);
  wait_for_cycles(0, 3);
  expect_no_further_cycle(0, 3);
  EXPECT_EQ(counters(0).lost_events, 0U);
}

TEST_P(ExternalEventTasks, StopAtTheEndOfACycleHoweverLongTheBacklogIs) {
  add(external("slow", "ready", [this] {
    while (!go) std::this_thread::yield();
    std::this_thread::sleep_for(milliseconds(1));
  }));
  ASSERT_TRUE(create());
  start(GetParam());
  post("ready", 100'000);
  go = true;
  wait_for_cycles(0, 3);
  EXPECT_TRUE(set->stop(seconds(10)));
  EXPECT_LT(counters(0).cycles, 100'000U);
}

INSTANTIATE_TEST_SUITE_P(Each, ExternalEventTasks, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
