#include <array>
#include <atomic>
#include <cstdio>

#include "tests/conformance/scheduler_fixture.hpp"

// The moment between all cycles, in which an online change exchanges the code of the tasks.

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

class BetweenCycles : public testing::TestWithParam<std::string_view>, public ManualTasks {
 protected:
  void TearDown() override { finish(); }

  /// A task whose code can be exchanged: each cycle says which one ran.
  TimePoint begin(const std::vector<Duration>& execution = {}) {
    add(cyclic("main", milliseconds(2), [this, execution, cycle = std::size_t{0}]() mutable {
      starts.push_back(clock.now());
      if (cycle < execution.size()) clock.spend(execution[cycle]);
      ++cycle;
      code();
    }));
    EXPECT_TRUE(create());
    return start(GetParam());
  }
  std::optional<Duration> change() {
    return set->between_cycles([this] { code = [this] { ++new_runs; }; });
  }

  Starts starts;
  int old_runs = 0;
  int new_runs = 0;
  std::function<void()> code = [this] { ++old_runs; };
};

TEST_P(BetweenCycles, OfTwoReleasesAnOnlineChangeLosesNoCycle) {
  const TimePoint origin = begin();
  clock.run_until(origin + microseconds(20'700));
  ASSERT_TRUE(change());
  clock.run_until(origin + milliseconds(40));
  EXPECT_EQ(starts, grid(origin, milliseconds(2), 21));
  EXPECT_EQ(counters(0).lost_cycles, 0U);
  EXPECT_EQ(old_runs, 11);
  EXPECT_EQ(new_runs, 10);
}

TEST_P(BetweenCycles, RightAfterAReleaseAnOnlineChangeNeitherLosesNorRepeatsIt) {
  const TimePoint origin = begin();
  clock.run_until(origin + milliseconds(20));
  ASSERT_TRUE(change());
  clock.run_until(origin + milliseconds(40));
  EXPECT_EQ(starts, grid(origin, milliseconds(2), 21));
  EXPECT_EQ(old_runs, 11);
}

TEST_P(BetweenCycles, IsNoMomentWithinACycle) {
  const TimePoint origin = begin({milliseconds(1)});
  clock.run_until(origin + microseconds(500));
  EXPECT_THAT(set->tasks_in_cycle(), testing::ElementsAre("main"));
  EXPECT_FALSE(change());
  clock.run_until(origin + microseconds(1500));
  EXPECT_EQ(old_runs, 1);
  EXPECT_TRUE(set->tasks_in_cycle().empty());
  EXPECT_TRUE(change());
  clock.run_until(origin + milliseconds(4));
  EXPECT_EQ(starts, grid(origin, milliseconds(2), 3));
  EXPECT_EQ(new_runs, 2);
}

TEST_P(BetweenCycles, AgainAndAgainKeepsTheGrid) {
  const TimePoint origin = begin();
  for (int i = 0; i < 100; ++i) {
    clock.run_for(microseconds(1730));
    ASSERT_TRUE(change());
  }
  const auto expected = (clock.now() - origin) / milliseconds(2) + 1;
  EXPECT_EQ(starts, grid(origin, milliseconds(2), static_cast<int>(expected)));
  EXPECT_EQ(counters(0).lost_cycles, 0U);
}

TEST_P(BetweenCycles, IsThereAlsoWhileTheTasksAreStopped) {
  begin();
  ASSERT_TRUE(set->stop(Duration::zero()));
  EXPECT_TRUE(change());
}

INSTANTIATE_TEST_SUITE_P(Each, BetweenCycles, testing::ValuesIn(every_scheduler()), scheduler_test_name);

class BetweenCyclesUnderLoad : public testing::TestWithParam<std::string_view>, public Tasks<LinuxClock> {};

// Real threads and real time: tasks of each kind, and variables that are read, while the code is exchanged a
// thousand times. No task ever sees the exchange within its cycle, and every release has run or is accounted
// for. The machine itself loses some, but not an exchange that took microseconds.
TEST_P(BetweenCyclesUnderLoad, NobodySeesAChangeWithinItsCycle) {
  constexpr int kChanges = 1000;
  std::array<std::uint64_t, 512> state{};  // exchanged word by word: a torn one would show
  std::atomic<std::uint64_t> torn{0};
  std::atomic<bool> level{false};
  const auto look = [&] {
    const std::uint64_t first = state.front();
    clock.spin_until(clock.now() + microseconds(20));
    for (const std::uint64_t word : state) {
      if (word != first) ++torn;
    }
  };
  add(cyclic("fast", microseconds(500), look));
  add(cyclic("slow", microseconds(1700), look));
  add(external("external", "ready", look));
  add(event(
      "event",
      [&] {
        look();
        return level.load();
      },
      look));
  add(freewheeling("loop", look));
  ASSERT_TRUE(create());
  SchedulerSettings settings;
  settings.scheduler_interval = microseconds(500);
  settings.watchdog.load = false;
  ASSERT_TRUE(set->start(GetParam(), settings));
  Duration longest{};
  int changes = 0;
  const TimePoint deadline = clock.now() + seconds(60);
  for (; changes < kChanges && clock.now() < deadline; std::this_thread::sleep_for(microseconds(100))) {
    event_named("ready").post();
    level = !level;
    const auto held = set->between_cycles([&] {
      for (std::uint64_t& word : state) ++word;
    });
    if (!held) continue;
    longest = std::max(longest, *held);
    ++changes;
  }
  wait_for_cycles(0, 10);
  wait_for_cycles(1, 1);
  ASSERT_TRUE(set->stop(seconds(30)));
  std::printf("%d changes; the longest held all tasks for %.1f us\n", changes,
              std::chrono::duration<double, std::micro>(longest).count());
  EXPECT_EQ(changes, kChanges);
  EXPECT_EQ(torn, 0U);
  const auto origin_of = [&](std::size_t task, Duration interval) {
    const TaskCounters now = counters(task);
    return Duration(now.release_ns) - static_cast<Duration::rep>(now.cycles + now.lost_cycles - 1) * interval;
  };
  EXPECT_EQ(origin_of(0, microseconds(500)), origin_of(1, microseconds(1700)));
}

INSTANTIATE_TEST_SUITE_P(Each, BetweenCyclesUnderLoad, testing::ValuesIn(every_scheduler()),
                         scheduler_test_name);

}  // namespace
}  // namespace plchost
