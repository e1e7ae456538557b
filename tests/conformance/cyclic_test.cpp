#include "tests/conformance/scheduler_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

class CyclicTasks : public testing::TestWithParam<std::string_view>, public ManualTasks {
 protected:
  void TearDown() override { finish(); }

  // A task that notes when its cycles begin, and whose cycle number i takes execution[i], the others no time.
  TaskConfig noting(Duration interval, std::vector<Duration> execution = {}) {
    return cyclic("main", interval, [this, execution, cycle = std::size_t{0}]() mutable {
      starts.push_back(clock.now());
      if (cycle < execution.size()) clock.spend(execution[cycle]);
      ++cycle;
    });
  }

  Starts starts;
};

TEST_P(CyclicTasks, RunOnTheGridThatBeginsAtTheCommonOrigin) {
  std::array<Starts, 3> of;
  const std::array<Duration, 3> interval{milliseconds(1), milliseconds(2), milliseconds(5)};
  for (std::size_t i = 0; i < of.size(); ++i) {
    add(cyclic("task" + std::to_string(i), interval[i], [this, &of, i] { of[i].push_back(clock.now()); }));
  }
  ASSERT_TRUE(create());
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(49));
  EXPECT_EQ(of[0], grid(origin, interval[0], 50));
  EXPECT_EQ(of[1], grid(origin, interval[1], 25));
  EXPECT_EQ(of[2], grid(origin, interval[2], 10));
  EXPECT_EQ(counters(0).lost_cycles, 0U);
  EXPECT_EQ(counters(0).jitter_max_ns, 0);
}

TEST_P(CyclicTasks, KeepTheirGridAfterAnOverrunAndCountWhatIsLost) {
  const auto none = Duration::zero();
  add(noting(milliseconds(2), {none, none, milliseconds(7), none}));
  ASSERT_TRUE(create());
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(16));
  const auto at = [&](int ms) { return origin + milliseconds(ms); };
  EXPECT_EQ(starts, (Starts{at(0), at(2), at(4), at(12), at(14), at(16)}));
  EXPECT_EQ(counters(0).lost_cycles, 3U);
  EXPECT_EQ(counters(0).latency_max_ns, 0);
  const auto ns = [](TimePoint time) { return time.time_since_epoch().count(); };
  EXPECT_EQ(counters(0).last_loss.lost, 3U);
  EXPECT_EQ(counters(0).last_loss.release_ns, ns(at(4)));
  EXPECT_EQ(counters(0).last_loss.start_ns, ns(at(4)));
  EXPECT_EQ(counters(0).last_loss.end_ns, ns(at(11)));
}

TEST_P(CyclicTasks, RunAtOnceIfTheyAreLateAndAreToldTo) {
  const auto none = Duration::zero();
  TaskConfig task = noting(milliseconds(2), {none, none, milliseconds(7), none});
  task.late = LatePolicy::asap;
  add(task);
  ASSERT_TRUE(create());
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(16));
  const auto at = [&](int ms) { return origin + milliseconds(ms); };
  EXPECT_EQ(starts, (Starts{at(0), at(2), at(4), at(11), at(12), at(14), at(16)}));
  EXPECT_EQ(counters(0).lost_cycles, 2U);
  EXPECT_EQ(counters(0).latency_max_ns, 1'000'000) << "it ran for the release at 10 ms";
}

TEST_P(CyclicTasks, CycleThatEndsExactlyAtTheNextReleaseLosesNothing) {
  add(noting(milliseconds(2), std::vector<Duration>(10, milliseconds(2))));
  ASSERT_TRUE(create());
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(10));
  EXPECT_EQ(starts, grid(origin, milliseconds(2), 6));
  EXPECT_EQ(counters(0).lost_cycles, 0U);
}

TEST_P(CyclicTasks, RunsAndLossesAddUpToAllReleases) {
  std::vector<Duration> execution;
  execution.reserve(400);
  for (int i = 0; i < 400; ++i) execution.push_back(microseconds((i * 7919) % 4000));
  add(noting(milliseconds(1), execution));
  ASSERT_TRUE(create());
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(700));
  const TaskCounters now = counters(0);
  const Duration last = TimePoint(Duration(now.release_ns)) - origin;
  EXPECT_EQ(now.cycles + now.lost_cycles, static_cast<std::uint64_t>(last / milliseconds(1)) + 1);
  EXPECT_EQ(last % milliseconds(1), Duration::zero());
}

TEST_P(CyclicTasks, IntervalThatIsNoMultipleOfTheTickKeepsItsNominalGrid) {
  add(noting(microseconds(1300)));
  std::vector<TimePoint> releases;
  ASSERT_TRUE(create());
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(130));
  EXPECT_EQ(counters(0).cycles, 101U);
  EXPECT_EQ(counters(0).lost_cycles, 0U);
  EXPECT_EQ(TimePoint(Duration(counters(0).release_ns)), origin + microseconds(130'000));
}

TEST_P(CyclicTasks, LateWakeUpsAreLateCyclesNotLostOnes) {
  add(noting(milliseconds(1)));
  ASSERT_TRUE(create());
  clock.set_wake_latency(microseconds(600));
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(100));
  EXPECT_GE(counters(0).cycles, 99U);
  EXPECT_EQ(counters(0).lost_cycles, 0U);
  EXPECT_GT(counters(0).latency_last_ns, 0);
}

TEST_P(CyclicTasks, CatchUpWithTheGridAfterAWakeUpThatWasPeriodsLate) {
  for (const LatePolicy late : {LatePolicy::next, LatePolicy::asap}) {
    TaskConfig task = cyclic("", milliseconds(1), [] {});
    task.name = late == LatePolicy::next ? "next" : "asap";
    task.late = late;
    add(task);
  }
  ASSERT_TRUE(create());
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(5));
  clock.set_wake_latency(microseconds(3500));
  clock.run_until(origin + milliseconds(20));
  clock.set_wake_latency(Duration::zero());
  clock.run_until(origin + milliseconds(30));
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(counters(i).latency_last_ns, 0);
    EXPECT_EQ(TimePoint(Duration(counters(i).release_ns)), origin + milliseconds(30));
    EXPECT_EQ(counters(i).cycles + counters(i).lost_cycles, 31U);
  }
}

TEST_P(CyclicTasks, BothTickSourcesKeepTheGrid) {
  add(noting(milliseconds(2)));
  ASSERT_TRUE(create());
  SchedulerSettings settings;
  settings.tick_source = TickSourceKind::task;
  const TimePoint origin = start(GetParam(), settings);
  clock.run_until(origin + milliseconds(20));
  EXPECT_EQ(starts, grid(origin, milliseconds(2), 11));
}

TEST_P(CyclicTasks, DoNotRunBeforeTheStartNorAfterTheStop) {
  add(noting(milliseconds(1)));
  ASSERT_TRUE(create());
  clock.run_for(milliseconds(10));
  EXPECT_TRUE(starts.empty());
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(3));
  ASSERT_TRUE(set->stop(std::chrono::seconds(10)));
  clock.run_for(milliseconds(10));
  EXPECT_EQ(starts.size(), 4U);
}

TEST_P(CyclicTasks, BeginANewGridWhenTheyStartAgainAndKeepTheirCounters) {
  add(noting(milliseconds(3)));
  ASSERT_TRUE(create());
  clock.run_until(start(GetParam()) + milliseconds(7));
  ASSERT_TRUE(set->stop(std::chrono::seconds(10)));
  EXPECT_FALSE(set->running());
  EXPECT_EQ(set->scheduler_name(), GetParam());
  clock.run_for(microseconds(12'345));
  starts.clear();
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(9));
  EXPECT_EQ(starts, grid(origin, milliseconds(3), 4));
  EXPECT_EQ(counters(0).cycles, 7U);
  EXPECT_EQ(counters(0).lost_cycles, 0U);
}

TEST_P(CyclicTasks, StopNamesTheTaskThatDoesNotComeBackAndParksItWhenItDoes) {
  add(noting(milliseconds(1), {milliseconds(50)}));
  add(cyclic("quick", milliseconds(1), [] {}));
  ASSERT_TRUE(create());
  clock.run_until(start(GetParam()) + milliseconds(5));
  const auto stopped = set->stop(milliseconds(300));
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::timed_out);
  EXPECT_THAT(stopped.error().message, testing::HasSubstr("main"));
  EXPECT_THAT(stopped.error().message, testing::Not(testing::HasSubstr("quick")));
  const auto again = set->start(GetParam(), {});
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::wrong_state);
  EXPECT_THAT(again.error().message, testing::HasSubstr("main"));
  clock.run_for(milliseconds(100));
  EXPECT_EQ(starts.size(), 1U);
  start(GetParam());
  clock.run_for(milliseconds(10));
  EXPECT_GT(starts.size(), 1U);
}

INSTANTIATE_TEST_SUITE_P(Each, CyclicTasks, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
