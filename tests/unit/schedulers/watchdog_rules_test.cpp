#include "schedulers/supervision/watchdog_rules.hpp"

#include <array>
#include <span>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "schedulers/faults/overrun_rule.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Answer = OverrunRule::Verdict;

TaskConfig task_with(Duration interval, TaskWatchdog watchdog = {}) {
  TaskConfig task;
  task.interval = interval;
  task.watchdog = watchdog;
  return task;
}
WatchdogSettings guard(Duration time) {
  WatchdogSettings settings;
  settings.default_time = time;
  return settings;
}

TEST(CycleLimit, IsTimeTimesSensitivityOfTheTask) {
  const TaskConfig task = task_with(milliseconds(10), {.time = milliseconds(4), .sensitivity = 5});
  EXPECT_EQ(cycle_limit(task, {}), (CycleLimit{.limit = milliseconds(20), .lenient = false}));
}

TEST(CycleLimit, OfATaskWithoutWatchdogIsTheGuardAgainstEndlessLoops) {
  EXPECT_EQ(cycle_limit(task_with(milliseconds(10)), guard(seconds(2))),
            (CycleLimit{.limit = seconds(2), .lenient = true}));
}

TEST(CycleLimit, OfALongIntervalIsTheInterval) {
  EXPECT_EQ(cycle_limit(task_with(seconds(13)), guard(seconds(2)))->limit, seconds(13));
}

TEST(CycleLimit, OfAVeryLongIntervalIsTenTimesTheGuard) {
  EXPECT_EQ(cycle_limit(task_with(seconds(60)), guard(milliseconds(700)))->limit, seconds(7));
}

TEST(CycleLimit, IsToldOncePerLimitWithItsTasks) {
  std::vector<TaskConfig> tasks(10, task_with(milliseconds(1)));
  for (std::size_t i = 0; i < tasks.size(); ++i) tasks[i].name = fmt::format("T{}", i);
  tasks.push_back(task_with(seconds(60)));
  tasks.back().name = "Minute";
  tasks.push_back(task_with(milliseconds(10), {.time = milliseconds(2), .sensitivity = 3}));
  tasks.back().name = "Own";
  EXPECT_THAT(
      describe_cycle_limits(tasks, guard(milliseconds(700))),
      testing::ElementsAre("a cycle may take 700 ms (the guard against endless loops): task T0, T1, T2, T3, "
                           "T4, T5, T6, T7 and 2 more",
                           "a cycle may take 7000 ms (the guard against endless loops): task Minute",
                           "a cycle may take 6 ms (the task's own watchdog): task Own"));
  EXPECT_THAT(describe_cycle_limits(std::span(tasks).first(1), guard(Duration::zero())),
              testing::ElementsAre("a cycle may take as long as it likes: task T0"));
}

TEST(CycleLimit, IsNoneIfTheGuardIsOff) {
  EXPECT_EQ(cycle_limit(task_with(milliseconds(10)), guard(Duration::zero())), std::nullopt);
}

TEST(OverrunRule, WithoutTimeAllowsEverything) {
  OverrunRule sut({});
  for (int i = 0; i < 10; ++i) EXPECT_EQ(sut.ended(seconds(100)), Answer::fine);
}

TEST(OverrunRule, HitsWhenOneCycleIsLongerThanTimeTimesSensitivityEvenTheFirst) {
  OverrunRule sut({.time = milliseconds(2), .sensitivity = 4});
  EXPECT_EQ(sut.ended(milliseconds(8)), Answer::fine);
  sut.forgive_next();
  EXPECT_EQ(sut.ended(milliseconds(8) + Duration(1)), Answer::too_long);
}

TEST(OverrunRule, HitsAtTheNthInARowAndNotBefore) {
  OverrunRule sut({.time = milliseconds(2), .sensitivity = 3});
  EXPECT_EQ(sut.ended(milliseconds(1)), Answer::fine);
  EXPECT_EQ(sut.ended(milliseconds(3)), Answer::fine);
  EXPECT_EQ(sut.ended(milliseconds(3)), Answer::fine);
  EXPECT_EQ(sut.ended(milliseconds(2)), Answer::fine);  // exactly the time is no overrun
  EXPECT_EQ(sut.ended(milliseconds(3)), Answer::fine);
  EXPECT_EQ(sut.ended(milliseconds(3)), Answer::fine);
  EXPECT_EQ(sut.ended(milliseconds(3)), Answer::too_many_in_a_row);
  EXPECT_EQ(sut.in_a_row(), 3U);
}

TEST(OverrunRule, FirstCycleAfterAnExchangeOfTheSchedulerIsNotCounted) {
  OverrunRule sut({.time = milliseconds(2), .sensitivity = 2});
  EXPECT_EQ(sut.ended(milliseconds(3)), Answer::fine);  // the first of all
  EXPECT_EQ(sut.ended(milliseconds(3)), Answer::fine);
  sut.forgive_next();
  EXPECT_EQ(sut.ended(milliseconds(3)), Answer::fine);
  EXPECT_EQ(sut.ended(milliseconds(3)), Answer::fine);
  EXPECT_EQ(sut.ended(milliseconds(3)), Answer::too_many_in_a_row);
}

class LoadRuleTest : public testing::Test {
 protected:
  // Two tasks, of which the second is freewheeling; one second passes.
  std::optional<LoadRule::Hit> second(int process_ms, int first_ms, int second_ms, int cores = 1) {
    process += milliseconds(process_ms);
    tasks[0] += milliseconds(first_ms);
    tasks[1] += milliseconds(second_ms);
    now += seconds(1);
    return sut.end(now, {.process = process, .tasks = tasks}, 60, cores);
  }

  LoadRule sut{{false, true}};
  TimePoint now{seconds(100)};
  Duration process = seconds(7);
  std::array<Duration, 2> tasks{seconds(1), seconds(2)};

  void SetUp() override { sut.begin(now, {.process = process, .tasks = tasks}); }
};

TEST_F(LoadRuleTest, HitsAboveTheMaximumAndNamesTheTask) {
  EXPECT_FALSE(second(600, 500, 0));
  const auto hit = second(610, 500, 0);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->percent, 61);
  EXPECT_EQ(hit->task, 0U);
}

TEST_F(LoadRuleTest, LooksAtEachWindowByItself) {
  EXPECT_FALSE(second(100, 50, 0));
  EXPECT_TRUE(second(990, 900, 0));
  EXPECT_FALSE(second(100, 50, 0));
}

TEST_F(LoadRuleTest, DoesNotCountWhatFreewheelingTasksTake) {
  EXPECT_FALSE(second(990, 100, 850));
}

TEST_F(LoadRuleTest, EndlessLoopOnOneOfManyCoresIsSeen) {
  EXPECT_TRUE(second(1000, 1000, 0, 8));
  EXPECT_FALSE(second(1000, 500, 0, 8));
}

}  // namespace
}  // namespace plchost
