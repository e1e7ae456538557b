#include <array>
#include <atomic>

#include <pthread.h>

#include "tests/conformance/scheduler_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

struct Pair {
  std::string_view from;
  std::string_view to;
};

std::vector<Pair> every_pair() {
  std::vector<Pair> pairs;
  for (const std::string_view from : every_scheduler()) {
    for (const std::string_view to : every_scheduler()) pairs.push_back({from, to});
  }
  return pairs;
}

std::string pair_name(const testing::TestParamInfo<Pair>& pair) {
  return std::string(pair.param.from) + "To" + std::string(pair.param.to);
}

class Switch : public testing::TestWithParam<Pair>, public ManualTasks {
 protected:
  void TearDown() override { finish(); }

  TimePoint begin(const std::vector<Duration>& execution = {}) {
    add(cyclic("main", milliseconds(2), [this, execution, cycle = std::size_t{0}]() mutable {
      starts.push_back(clock.now());
      if (cycle < execution.size()) clock.spend(execution[cycle]);
      ++cycle;
    }));
    EXPECT_TRUE(create());
    return start(GetParam().from);
  }
  void switch_over() {
    const auto switched = set->switch_to(GetParam().to, {});
    EXPECT_TRUE(switched) << switched.error().describe();
    EXPECT_EQ(set->scheduler_name(), GetParam().to);
  }

  Starts starts;
};

TEST_P(Switch, BetweenTwoReleasesKeepsTheGrid) {
  const TimePoint origin = begin();
  clock.run_until(origin + microseconds(20'700));
  switch_over();
  clock.run_until(origin + milliseconds(40));
  EXPECT_EQ(starts, grid(origin, milliseconds(2), 21));
  EXPECT_EQ(counters(0).lost_cycles, 0U);
  EXPECT_EQ(counters(0).cycles, 21U);
}

TEST_P(Switch, ExactlyAtAReleaseNeitherLosesNorRepeatsIt) {
  const TimePoint origin = begin();
  clock.run_until(origin + milliseconds(20));
  switch_over();
  clock.run_until(origin + milliseconds(40));
  EXPECT_EQ(starts, grid(origin, milliseconds(2), 21));
}

TEST_P(Switch, BeforeTheFirstReleaseKeepsTheOrigin) {
  const TimePoint origin = begin();
  switch_over();
  clock.run_until(origin + milliseconds(4));
  EXPECT_EQ(starts, grid(origin, milliseconds(2), 3));
}

TEST_P(Switch, DuringACycleTakesEffectAtItsEndAndLosesWhatTheOverrunLost) {
  const TimePoint origin = begin({milliseconds(5)});
  clock.run_until(origin + milliseconds(3));
  switch_over();
  clock.run_until(origin + milliseconds(40));
  EXPECT_EQ(starts.front(), origin);
  EXPECT_EQ((starts.back() - origin) % milliseconds(2), Duration::zero());
  EXPECT_EQ(counters(0).cycles + counters(0).lost_cycles, 21U);
  EXPECT_EQ(counters(0).lost_cycles, 2U);
}

TEST_P(Switch, AgainAndAgainKeepsTheGrid) {
  const TimePoint origin = begin();
  for (int i = 0; i < 50; ++i) {
    clock.run_for(microseconds(1730));
    switch_over();
    clock.run_for(microseconds(910));
    ASSERT_TRUE(set->switch_to(GetParam().from, {}));
  }
  const auto expected = (clock.now() - origin) / milliseconds(2) + 1;
  EXPECT_EQ(starts, grid(origin, milliseconds(2), static_cast<int>(expected)));
}

INSTANTIATE_TEST_SUITE_P(EveryPair, Switch, testing::ValuesIn(every_pair()), pair_name);

TEST(SwitchOfRunningTasks, ToAnUnknownSchedulerIsRefusedAndTheyRunOn) {
  ManualTasks tasks;
  tasks.add(ManualTasks::cyclic("main", milliseconds(1), [] {}));
  ASSERT_TRUE(tasks.create());
  const TimePoint origin = tasks.start("CmpScheduleTimer");
  const auto switched = tasks.set->switch_to("CmpScheduleTimers", {});
  ASSERT_FALSE(switched);
  EXPECT_EQ(switched.error().code, ErrorCode::invalid_argument);
  EXPECT_THAT(switched.error().message, testing::HasSubstr(scheduler_names()));
  EXPECT_EQ(tasks.set->scheduler_name(), "CmpScheduleTimer");
  tasks.clock.run_until(origin + milliseconds(9));
  EXPECT_EQ(tasks.counters(0).cycles, 10U);
}

TEST(SwitchOfRunningTasks, ThatCannotBePreparedLeavesTheOldSchedulerInPlace) {
  for (const auto& [from, to] : every_pair()) {
    std::atomic<bool> variable{false};
    ManualTasks tasks;
    tasks.add(ManualTasks::cyclic("main", milliseconds(1), [] {}));
    tasks.add(ManualTasks::event("on_edge", [&] { return variable.load(); }, [] {}));
    ASSERT_TRUE(tasks.create());
    const TimePoint origin = tasks.start(from);
    tasks.clock.run_until(origin + milliseconds(5));
    tasks.clock.refuse_timers(true);
    const auto switched = tasks.set->switch_to(to, {});
    ASSERT_FALSE(switched);
    EXPECT_EQ(switched.error().code, ErrorCode::full);
    EXPECT_EQ(tasks.set->scheduler_name(), from);
    variable = true;
    tasks.clock.run_until(origin + milliseconds(10));
    EXPECT_EQ(tasks.counters(0).cycles, 11U);
    EXPECT_EQ(tasks.counters(1).cycles, 1U);
  }
}

TEST(SwitchOfRunningTasks, NeedsRunningTasks) {
  ManualTasks tasks;
  tasks.add(ManualTasks::cyclic("main", milliseconds(1), [] {}));
  ASSERT_TRUE(tasks.create());
  EXPECT_EQ(tasks.set->scheduler_name(), "");
  EXPECT_EQ(tasks.set->switch_to("CmpSchedule", {}).error().code, ErrorCode::wrong_state);
  EXPECT_EQ(tasks.set->stop(seconds(1)).error().code, ErrorCode::wrong_state);
  tasks.start("CmpSchedule");
  EXPECT_EQ(tasks.set->start("CmpSchedule", {}).error().code, ErrorCode::wrong_state);
}

/// A task "main" of 1 ms. Each change of its state goes into `told`.
Result<std::unique_ptr<TaskSet>> main_that_tells(Clock& clock, TaskStatistics& statistics,
                                                 std::vector<bool>& told) {
  TaskEnvironment environment;
  environment.allow_unprivileged = true;
  environment.statistics = [&](std::size_t) -> TaskStatistics& { return statistics; };
  environment.state_changed = [&](std::size_t, bool running) { told.push_back(running); };
  return TaskSet::create(clock, PriorityBand::low, {ManualTasks::cyclic("main", milliseconds(1), [] {})},
                         environment);
}

TEST(SwitchOfRunningTasks, TellsWhichTasksRunAndWhichAreParked) {
  LinuxClock clock;
  std::vector<bool> told;
  TaskStatistics statistics{};
  const auto set = main_that_tells(clock, statistics, told);
  ASSERT_TRUE(set);
  ASSERT_TRUE((*set)->start("CmpSchedule", {}));
  EXPECT_THAT((*set)->still_busy(MonotonicClock::now() + seconds(30)), testing::IsEmpty());
  ASSERT_TRUE((*set)->switch_to("CmpScheduleOneShot", {}));
  ASSERT_TRUE((*set)->stop(seconds(10)));
  EXPECT_EQ(told, (std::vector<bool>{true, false}));
}

/// The real clock, by which the thread of task "main" wakes only when `held` is false: others have its core.
class HeldClock final : public Clock {
 public:
  std::atomic<bool> held{false};
  std::atomic<bool> sleeps{false};

  [[nodiscard]] TimePoint now() const noexcept override { return real_.now(); }
  void wait(const std::atomic<std::uint32_t>& word, std::uint32_t expected,
            TimePoint deadline) noexcept override {
    std::array<char, 16> name{};
    pthread_getname_np(pthread_self(), name.data(), name.size());
    const bool is_of_task = std::string_view(name.data()) == "main";
    if (is_of_task) sleeps = true;
    real_.wait(word, expected, deadline);
    while (is_of_task && held) std::this_thread::sleep_for(milliseconds(1));
  }
  void wake(const std::atomic<std::uint32_t>& word) noexcept override { real_.wake(word); }
  void wait(CountedEvent& event, CountedEvent::Snapshot seen) noexcept override { real_.wait(event, seen); }
  void spin_until(TimePoint deadline) noexcept override { real_.spin_until(deadline); }
  [[nodiscard]] Result<std::unique_ptr<PeriodicTimer>> make_periodic_timer() override {
    return real_.make_periodic_timer();
  }

 private:
  LinuxClock real_;
};

TEST(SwitchOfRunningTasks, TellsThatATaskRunsIfItsThreadGetsNoCoreAtTheStart) {
  HeldClock clock;
  std::vector<bool> told;
  TaskStatistics statistics{};
  const auto set = main_that_tells(clock, statistics, told);
  ASSERT_TRUE(set);
  clock.held = true;
  while (!clock.sleeps) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_TRUE((*set)->start("CmpScheduleTimer", {}));  // waits for a while
  clock.held = false;
  EXPECT_EQ(told, (std::vector<bool>{true}));
  EXPECT_TRUE((*set)->stop(seconds(10)));
  EXPECT_EQ(told, (std::vector<bool>{true, false}));
}

// Real threads and real time: races that can come at any instruction come here at some of them.
TEST(SwitchOfRunningTasks, LosesAndRepeatsNoPostAndNoRelease) {
  constexpr std::uint64_t kPosts = 10'000;
  std::atomic<bool> variable{false};
  std::atomic<std::uint64_t> runs{0};
  Tasks<LinuxClock> tasks;
  for (int i = 0; i < 2; ++i) {
    tasks.add(ManualTasks::external("external" + std::to_string(i), "ready", [&runs] { ++runs; }));
  }
  tasks.add(ManualTasks::cyclic("fast", microseconds(500), [] {}));
  tasks.add(ManualTasks::cyclic("slow", microseconds(1700), [] {}));
  tasks.add(ManualTasks::event("event", [&] { return variable.load(); }, [] {}));
  tasks.add(ManualTasks::freewheeling("loop", [] {}));
  ASSERT_TRUE(tasks.create());
  SchedulerSettings settings;
  settings.scheduler_interval = microseconds(250);
  ASSERT_TRUE(tasks.set->start("CmpSchedule", settings));
  std::thread poster([&] {
    for (std::uint64_t i = 0; i < kPosts; ++i) {
      tasks.event_named("ready").post();
      if (i % 20 == 0) std::this_thread::sleep_for(microseconds(100));
    }
  });
  for (std::size_t i = 0; tasks.event_named("ready").count() < kPosts; ++i) {
    const auto schedulers = all_schedulers();
    ASSERT_TRUE(tasks.set->switch_to(schedulers[i % schedulers.size()].name, settings));
    if (i % 3 == 0) std::this_thread::sleep_for(milliseconds(1));
  }
  poster.join();
  for (std::size_t i = 0; i < 2; ++i) tasks.wait_for_cycles(i, kPosts);
  std::this_thread::sleep_for(milliseconds(5));
  variable = true;
  for (const std::size_t task : {2U, 3U, 4U}) tasks.wait_for_cycles(task, 1);
  ASSERT_TRUE(tasks.set->stop(seconds(30)));
  EXPECT_EQ(runs, 2 * kPosts);
  EXPECT_EQ(tasks.counters(0).lost_events, 0U);
  EXPECT_EQ(tasks.counters(4).cycles, 1U);
  // All releases of a grid have run or are counted as lost: the two tasks began at the same origin.
  const auto origin_of = [&](std::size_t task, Duration interval) {
    const TaskCounters now = tasks.counters(task);
    return Duration(now.release_ns) - static_cast<Duration::rep>(now.cycles + now.lost_cycles - 1) * interval;
  };
  EXPECT_EQ(origin_of(2, microseconds(500)), origin_of(3, microseconds(1700)));
}

}  // namespace
}  // namespace plchost
