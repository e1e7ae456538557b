#include <stdexcept>

#include "tests/conformance/scheduler_fixture.hpp"
#include "tests/support/sleeping_thread.hpp"

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
  /// The actions of a poster that is killed before it wakes anybody.
  void add_without_wake(std::string_view name, std::uint64_t count) {
    reinterpret_cast<std::atomic<std::uint64_t>&>(event_named(name)).fetch_add(count << 16);
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

TEST_P(ExternalEventTasks, PostsWhileTheyWereStoppedAreNotRunButLost) {
  add(external("on_ready", "ready", [] {}));
  ASSERT_TRUE(create());
  post("ready", 7);
  start(GetParam());
  EXPECT_EQ(counters(0).lost_events, 7U);
  post("ready", 1);
  wait_for_cycles(0, 1);
  ASSERT_TRUE(set->stop(seconds(10)));
  post("ready", 9);
  set->look_after_posts();
  EXPECT_EQ(counters(0).lost_events, 16U) << "counted while it is stopped";
  post("ready", 1);
  start(GetParam());
  post("ready", 2);
  wait_for_cycles(0, 3);
  expect_no_further_cycle(0, 3);
  EXPECT_EQ(counters(0).lost_events, 17U);
}

TEST_P(ExternalEventTasks, ABacklogThatAStopLeavesIsLost) {
  add(external("slow", "ready", [this] {
    entered = true;
    while (!go) std::this_thread::yield();
  }));
  ASSERT_TRUE(create());
  start(GetParam());
  post("ready", 1000);
  while (!entered) std::this_thread::yield();
  ASSERT_TRUE(set->begin_stop({}));
  ASSERT_FALSE(set->advance_stop()) << "a task that drives no outputs is asked to park in the second phase";
  go = true;
  while (!set->advance_stop()) std::this_thread::yield();
  EXPECT_EQ(counters(0).cycles, 1U);
  EXPECT_EQ(counters(0).lost_events, 999U);
  ASSERT_TRUE(set->reset_statistics("slow"));
  EXPECT_EQ(counters(0).lost_events, 0U);
  post("ready", 5);
  set->look_after_posts();
  EXPECT_EQ(counters(0).cycles, 1U);
  EXPECT_EQ(counters(0).lost_events, 5U);
}

TEST_P(ExternalEventTasks, ATaskWhosePosterEndedBeforeTheWakeIsWoken) {
  add(external("on_ready", "ready", [] {}));
  ASSERT_TRUE(create());
  start(GetParam());
  post("ready", 1);
  wait_for_cycles(0, 1);
  clock.settle();
  while (!sleeps(set->task(0).trap().thread())) std::this_thread::sleep_for(milliseconds(1));
  add_without_wake("ready", 2);
  expect_no_further_cycle(0, 1);
  set->look_after_posts();
  wait_for_cycles(0, 3);
  expect_no_further_cycle(0, 3);
  EXPECT_EQ(counters(0).lost_events, 0U);
}

TEST_P(ExternalEventTasks, PostsToATaskInExceptionAreLost) {
  TaskConfig task = external("faulty", "ready", [this] {
    if (go) throw std::runtime_error("no more");
  });
  task.watchdog.policy = WatchdogPolicy::task;
  add(std::move(task));
  add(external("sound", "ready", [] {}));
  ASSERT_TRUE(create());
  start(GetParam());
  post("ready", 3);
  wait_for_cycles(0, 3);
  go = true;
  post("ready", 4);
  wait_for_cycles(1, 7);
  while (counters(0).lost_events < 4) set->look_after_posts();
  EXPECT_EQ(counters(0).cycles, 3U);
  EXPECT_EQ(counters(0).lost_events, 4U) << "the one whose cycle did not come to its end is among them";
  EXPECT_EQ(counters(1).lost_events, 0U);
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

// Each post of several posters at once is run or lost, whatever starts, stops and exchanges of the scheduler
// there are meanwhile.
TEST_P(ExternalEventTasks, EachPostIsRunOrLostAcrossStopsAndExchanges) {
  constexpr int kPosters = 3;
  constexpr int kRounds = 60;
  Tasks<LinuxClock> tasks;
  std::atomic<std::uint64_t> runs{0};
  tasks.add(tasks.external("on_ready", "ready", [&] { ++runs; }));
  ASSERT_TRUE(tasks.create());
  SchedulerSettings settings;
  settings.max_event_backlog = 50;
  CountedEvent& event = tasks.event_named("ready");
  std::atomic<bool> enough{false};
  {
    std::vector<std::jthread> posters;
    for (int i = 0; i < kPosters; ++i) {
      posters.emplace_back([&] {
        while (!enough) {
          event.post();
          std::this_thread::sleep_for(std::chrono::microseconds(20));
        }
      });
    }
    const auto names = every_scheduler();
    for (std::size_t round = 0; round < kRounds; ++round) {
      ASSERT_TRUE(tasks.set->start(GetParam(), settings));
      std::this_thread::sleep_for(milliseconds(2));
      ASSERT_TRUE(tasks.set->switch_to(names[round % names.size()], settings));
      std::this_thread::sleep_for(milliseconds(2));
      ASSERT_TRUE(tasks.set->stop(seconds(10)));
      std::this_thread::sleep_for(milliseconds(1));
    }
    enough = true;
  }
  tasks.set->look_after_posts();
  EXPECT_EQ(tasks.counters(0).cycles, runs);
  EXPECT_GT(tasks.counters(0).lost_events, 0U);
  EXPECT_EQ(tasks.counters(0).cycles + tasks.counters(0).lost_events, event.count());
}

INSTANTIATE_TEST_SUITE_P(Each, ExternalEventTasks, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
