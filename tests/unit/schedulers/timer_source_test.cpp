#include <random>

#include <gtest/gtest.h>

#include "schedulers/activation/self_timed_sources.hpp"
#include "schedulers/task_set.hpp"
#include "tests/conformance/scheduler_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr std::string_view kTimer = "CmpScheduleTimer";

TEST(TimerSource, TimerCountsTheOverrunsThatTheGridCounts) {
  for (const LatePolicy late : {LatePolicy::next, LatePolicy::asap}) {
    std::mt19937 random(11);
    ManualTasks tasks;
    TaskConfig config = ManualTasks::cyclic("main", milliseconds(1), [&] {
      // Long ones, and in between so many empty ones that the task is on time again.
      const int pick = std::uniform_int_distribution(0, 9)(random);
      if (pick == 0) tasks.clock.spend(microseconds(std::uniform_int_distribution(1, 5000)(random)));
    });
    config.late = late;
    tasks.add(config);
    ASSERT_TRUE(tasks.create());
    const TimePoint origin = tasks.start(kTimer);
    int compared = 0;
    for (int i = 1; i < 2000; ++i) {
      tasks.clock.run_until(origin + milliseconds(i));
      const TaskCounters now = tasks.counters(0);
      if (TimePoint(Duration(now.release_ns)) != origin + milliseconds(i)) continue;  // busy
      if (now.latency_last_ns != 0) continue;
      ASSERT_EQ(now.timer_expirations, now.cycles + now.lost_cycles) << "at " << i << " ms";
      ++compared;
    }
    EXPECT_GT(compared, 500);
    EXPECT_GT(tasks.counters(0).lost_cycles, 100U);
  }
}

TEST(TimerSource, KernelsTimerCountsTheOverrunsThatTheGridCounts) {
  Tasks<LinuxClock> tasks;
  int cycle = 0;
  tasks.add(Tasks<LinuxClock>::cyclic("main", milliseconds(2), [&] {
    if (++cycle % 5 == 0) std::this_thread::sleep_for(milliseconds(7));
  }));
  ASSERT_TRUE(tasks.create());
  ASSERT_TRUE(tasks.set->start(kTimer, {}));
  tasks.wait_for_cycles(0, 40);
  // The count may be ahead by what went off between a late wake-up and the look at it: it agrees again at a
  // cycle that is on time.
  bool agreed = false;
  TaskCounters now{};
  for (int i = 0; i < 10'000 && !agreed; ++i) {
    now = tasks.counters(0);
    agreed = now.timer_expirations == now.cycles + now.lost_cycles;
    std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_TRUE(agreed) << now.timer_expirations << " expirations, " << now.cycles << " cycles, "
                      << now.lost_cycles << " lost";
  EXPECT_GE(now.lost_cycles, 7U * 3U);
  ASSERT_TRUE(tasks.set->stop(std::chrono::seconds(10)));
}

TEST(TimerSource, FollowsAnIntervalThatChangesInEachCycle) {
  ManualTasks tasks;
  Starts starts;
  tasks.add(ManualTasks::cyclic("main", milliseconds(1), [&] {
    starts.push_back(tasks.clock.now());
    // There and back, so that also an interval comes again that the timer had before.
    (void)tasks.set->task(0).set_interval(milliseconds(1) +
                                          Duration(static_cast<int>(starts.size()) % 4 * 7));
  }));
  ASSERT_TRUE(tasks.create());
  TimePoint expected = tasks.start(kTimer);
  tasks.clock.run_until(expected + milliseconds(200));
  ASSERT_GT(starts.size(), 150U);
  for (std::size_t i = 0; i < starts.size(); ++i) {
    ASSERT_EQ(starts[i], expected) << "cycle " << i;
    expected += milliseconds(1) + Duration((i + 1) % 4 * 7);
  }
}

}  // namespace
}  // namespace plchost
