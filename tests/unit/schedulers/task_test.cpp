#include "schedulers/tasks/task.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

#include "schedulers/activation/single_cycle.hpp"
#include "schedulers/tasks/event_latch.hpp"
#include "tests/support/manual_clock.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

class TaskTest : public testing::Test {
 protected:
  TaskConfig cyclic() {
    TaskConfig config;
    config.name = "main";
    config.interval = milliseconds(10);
    config.entry = [this] { clock.run_for(execution); };
    return config;
  }
  TaskCounters counters() { return statistics.counters.read().value(); }
  // Runs the next release, begun `latency` after it.
  void run_next(Task& sut, Duration latency) {
    const Activation activation = sut.next_release(FreewheelRule({}));
    clock.run_until(activation.release + latency);
    sut.run_cycle(activation);
  }

  ManualClock clock;
  TaskStatistics statistics{};
  Duration execution = milliseconds(2);
};

TEST_F(TaskTest, RecordsExecutionTimes) {
  Task sut(clock, cyclic(), statistics, nullptr);
  sut.begin(clock.now());
  for (const int ms : {3, 1, 2}) {
    execution = milliseconds(ms);
    run_next(sut, Duration::zero());
  }
  EXPECT_EQ(counters().cycles, 3U);
  EXPECT_EQ(counters().exec_last_ns, 2'000'000);
  EXPECT_EQ(counters().exec_min_ns, 1'000'000);
  EXPECT_EQ(counters().exec_max_ns, 3'000'000);
  EXPECT_EQ(counters().exec_sum_ns, 6'000'000);
}

TEST_F(TaskTest, LatencyIsStartMinusPlannedRelease) {
  Task sut(clock, cyclic(), statistics, nullptr);
  const TimePoint origin = clock.now();
  sut.begin(origin);
  for (const int us : {30, 70, 10}) run_next(sut, microseconds(us));
  EXPECT_EQ(counters().latency_last_ns, 10'000);
  EXPECT_EQ(counters().latency_max_ns, 70'000);
  EXPECT_EQ(TimePoint(Duration(counters().release_ns)), origin + milliseconds(20));
  EXPECT_EQ(statistics[TaskHistogram::latency].total(), 3U);
}

TEST_F(TaskTest, PeriodJitterIsSigned) {
  Task sut(clock, cyclic(), statistics, nullptr);
  sut.begin(clock.now());
  run_next(sut, microseconds(50));
  EXPECT_EQ(counters().jitter_last_ns, 0) << "one start is no period";
  run_next(sut, microseconds(10));
  EXPECT_EQ(counters().jitter_last_ns, -40'000);
  run_next(sut, microseconds(30));
  EXPECT_EQ(counters().jitter_last_ns, 20'000);
  EXPECT_EQ(counters().jitter_min_ns, -40'000);
  EXPECT_EQ(counters().jitter_max_ns, 20'000);
  EXPECT_EQ(largest_jitter_ns(counters()), 40'000);
}

TEST_F(TaskTest, LostCyclesAreCountedAndAreNoJitter) {
  Task sut(clock, cyclic(), statistics, nullptr);
  sut.begin(clock.now());
  execution = milliseconds(35);
  run_next(sut, Duration::zero());
  execution = milliseconds(1);
  run_next(sut, Duration::zero());
  EXPECT_EQ(counters().lost_cycles, 3U);
  EXPECT_EQ(counters().jitter_last_ns, 0);
}

TEST_F(TaskTest, CountersGoOnAfterANewBegin) {
  Task sut(clock, cyclic(), statistics, nullptr);
  sut.begin(clock.now());
  run_next(sut, Duration::zero());
  clock.run_for(std::chrono::seconds(3));
  const TimePoint origin = clock.now() + milliseconds(7);
  sut.begin(origin);
  EXPECT_EQ(sut.next_release(FreewheelRule({})).release, origin);
  run_next(sut, Duration::zero());
  EXPECT_EQ(counters().cycles, 2U);
  EXPECT_EQ(counters().lost_cycles, 0U);
  EXPECT_EQ(counters().periods, 0U) << "the time between stop and start is no period";
}

TEST_F(TaskTest, IntervalSetInItsOwnCyclePlacesTheNextRelease) {
  Task* self = nullptr;
  TaskConfig config = cyclic();
  config.entry = [&] { ASSERT_TRUE(self->set_interval(Duration(10'000'001))); };
  Task sut(clock, config, statistics, nullptr);
  self = &sut;
  const TimePoint origin = clock.now();
  sut.begin(origin);
  run_next(sut, Duration::zero());
  EXPECT_EQ(sut.next_release(FreewheelRule({})).release, origin + Duration(10'000'001));
  run_next(sut, Duration::zero());
  EXPECT_EQ(sut.next_release(FreewheelRule({})).release, origin + Duration(20'000'002));
}

TEST_F(TaskTest, IntervalSetWhileItWaitsLeavesThePlannedRelease) {
  Task sut(clock, cyclic(), statistics, nullptr);
  const TimePoint origin = clock.now();
  sut.begin(origin);
  run_next(sut, Duration::zero());
  ASSERT_TRUE(sut.set_interval(milliseconds(7)));
  EXPECT_EQ(sut.interval(), milliseconds(7));
  EXPECT_EQ(sut.interval_in_force(), milliseconds(10));
  EXPECT_EQ(sut.next_release(FreewheelRule({})).release, origin + milliseconds(10));
  EXPECT_EQ(counters().interval_ns, 10'000'000);
  run_next(sut, Duration::zero());
  EXPECT_EQ(sut.next_release(FreewheelRule({})).release, origin + milliseconds(17));
  EXPECT_EQ(counters().interval_ns, 7'000'000);
}

TEST_F(TaskTest, ChangeOfTheIntervalIsNoJitter) {
  Task sut(clock, cyclic(), statistics, nullptr);
  sut.begin(clock.now());
  for (const int ms : {10, 7, 23, 3}) {
    ASSERT_TRUE(sut.set_interval(milliseconds(ms)));
    run_next(sut, Duration::zero());
  }
  EXPECT_EQ(counters().jitter_max_ns, 0);
}

TEST_F(TaskTest, IntervalThatWasSetHoldsAfterANewBegin) {
  Task sut(clock, cyclic(), statistics, nullptr);
  sut.begin(clock.now());
  ASSERT_TRUE(sut.set_interval(milliseconds(4)));
  const TimePoint origin = clock.now() + milliseconds(1);
  sut.begin(origin);
  run_next(sut, Duration::zero());
  EXPECT_EQ(sut.next_release(FreewheelRule({})).release, origin + milliseconds(4));
}

TEST_F(TaskTest, RefusesIntervalsOutOfRangeAndOfOtherKinds) {
  Task sut(clock, cyclic(), statistics, nullptr);
  EXPECT_FALSE(sut.set_interval(kMinRuntimeInterval - Duration(1)));
  EXPECT_FALSE(sut.set_interval(Duration(-1)));
  EXPECT_FALSE(sut.set_interval(kMaxInterval + Duration(1)));
  EXPECT_EQ(sut.interval(), milliseconds(10));
  EXPECT_TRUE(sut.set_interval(kMinRuntimeInterval));
  EXPECT_TRUE(sut.set_interval(kMaxInterval));
  TaskConfig config = cyclic();
  config.kind = TaskKind::freewheeling;
  Task other(clock, config, statistics, nullptr);
  EXPECT_FALSE(other.set_interval(milliseconds(1)));
  EXPECT_EQ(other.interval(), Duration::zero());
}

TEST_F(TaskTest, SpunTimeAndLostEventsAddUp) {
  Task sut(clock, cyclic(), statistics, nullptr);
  sut.begin(clock.now());
  for (int i = 0; i < 3; ++i) {
    Activation activation = sut.next_release(FreewheelRule({}));
    activation.spun = microseconds(20);
    activation.lost_events = 5;
    sut.run_cycle(activation);
  }
  EXPECT_EQ(counters().spin_sum_ns, 60'000);
  EXPECT_EQ(counters().lost_events, 15U);
}

TEST_F(TaskTest, AfterCycleSeesTheCountersOfItsCycle) {
  std::uint64_t seen = 0;
  TaskConfig config = cyclic();
  config.after_cycle = [&](const TaskCounters& now) { seen = now.cycles; };
  Task sut(clock, config, statistics, nullptr);
  sut.begin(clock.now());
  run_next(sut, Duration::zero());
  EXPECT_EQ(seen, 1U);
}

TEST_F(TaskTest, FreewheelingBeginsAtTheOriginAndThenSleepsItsShare) {
  TaskConfig config = cyclic();
  config.kind = TaskKind::freewheeling;
  config.entry = [this] {
    clock.run_for(execution);
    clock.charge(execution);
  };
  Task sut(clock, config, statistics, nullptr);
  const TimePoint origin = clock.now() + milliseconds(1);
  sut.begin(origin);
  EXPECT_EQ(sut.next_release(FreewheelRule({})).release, origin);
  execution = milliseconds(10);
  run_next(sut, Duration::zero());
  EXPECT_EQ(sut.next_release(FreewheelRule({})).release, clock.now() + milliseconds(2));
}

TEST_F(TaskTest, ExceptionOutOfACycleIsItsFaultWithTypeAndText) {
  TaskConfig config = cyclic();
  config.entry = [] { throw std::out_of_range("index 7"); };
  FaultBoard board;
  Task sut(clock, config, statistics, nullptr, &board);
  sut.begin(clock.now());
  run_next(sut, Duration::zero());
  ASSERT_NE(sut.fault().published(), nullptr);
  EXPECT_EQ(describe_fault(*sut.fault().published()), "std::out_of_range left its cycle: index 7");
  EXPECT_TRUE(board.halted());
  EXPECT_FALSE(sut.trap().parked());
}

TEST_F(TaskTest, SomethingThrownThatIsNoStandardExceptionIsAFaultToo) {
  TaskConfig config = cyclic();
  config.entry = [] { throw 42; };
  Task sut(clock, config, statistics, nullptr);
  sut.begin(clock.now());
  run_next(sut, Duration::zero());
  ASSERT_NE(sut.fault().published(), nullptr);
  EXPECT_EQ(describe_fault(*sut.fault().published()), "int left its cycle: not a std::exception");
}

TEST_F(TaskTest, FaultOfATaskByItselfHaltsNoOther) {
  TaskConfig config = cyclic();
  config.watchdog.policy = WatchdogPolicy::task;
  config.entry = [] { throw 42; };
  FaultBoard board;
  Task sut(clock, config, statistics, nullptr, &board);
  Task other(clock, cyclic(), statistics, nullptr, &board);
  sut.begin(clock.now());
  run_next(sut, Duration::zero());
  EXPECT_TRUE(sut.fault().halts());
  EXPECT_FALSE(other.fault().halts());
}

TEST_F(TaskTest, StopThatItDoesNotComeBackForIsAFaultOfTheWholeApplication) {
  TaskConfig config = cyclic();
  config.watchdog.policy = WatchdogPolicy::task;
  FaultBoard board;
  Task sut(clock, config, statistics, nullptr, &board);
  raise_stop_timeout(sut.fault(), StopPhase::outputs, milliseconds(200));
  raise_stop_timeout(sut.fault(), StopPhase::others, milliseconds(300));  // the first one is kept
  const FaultRecord* const record = sut.fault().published();
  ASSERT_NE(record, nullptr);
  EXPECT_EQ(to_string(record->kind), "stop_timeout");
  EXPECT_EQ(describe_fault(*record),
            "not at the end of its cycle after 200 ms, the limit of the first phase of a stop (tasks that "
            "drive outputs)");
  EXPECT_GT(record->unix_ns, 0);
  EXPECT_TRUE(board.halted());
}

TEST_F(TaskTest, StopTimeoutTellsItsPhase) {
  FaultRecord record;
  record.kind = FaultKind::stop_timeout;
  record.limit = Duration(milliseconds(25'000)).count();
  record.phase = StopPhase::others;
  EXPECT_EQ(describe_fault(record),
            "not at the end of its cycle after 25000 ms, the limit of the second phase of a stop (tasks that "
            "drive no outputs)");
  record.phase = StopPhase::single_cycle;
  EXPECT_EQ(describe_fault(record),
            "not at the end of its cycle after 25000 ms, the limit of a single cycle of all tasks");
}

TEST_F(TaskTest, StopTimeoutTellsThatAnEventVariableHasNotReturned) {
  FaultBoard board;
  Task sut(clock, cyclic(), statistics, nullptr, &board);
  raise_stop_timeout(sut.fault(), StopPhase::others, milliseconds(800), true);
  EXPECT_EQ(
      describe_fault(*sut.fault().published()),
      "its event variable has not returned after 800 ms, the limit of the second phase of a stop (tasks that "
      "drive no outputs)");
}

TEST_F(TaskTest, WatchdogHitsAtTheEndOfTheNthOverrunInARow) {
  TaskConfig config = cyclic();
  config.watchdog = {.time = milliseconds(3), .sensitivity = 3};
  Task sut(clock, config, statistics, nullptr);
  sut.begin(clock.now());
  for (const int ms : {4, 4, 4, 3, 4, 4}) {  // the first does not count, the 3 ms break the row
    execution = milliseconds(ms);
    run_next(sut, Duration::zero());
    ASSERT_FALSE(sut.fault().raised());
  }
  run_next(sut, Duration::zero());
  ASSERT_NE(sut.fault().published(), nullptr);
  EXPECT_EQ(describe_fault(*sut.fault().published()),
            "3 cycles in a row took longer than 3.000 ms, the last 4.000 ms");
  EXPECT_EQ(counters().cycles, 7U);
}

TEST_F(TaskTest, KnowsTheFirstReleaseThatNoCycleHasBegunFor) {
  Task sut(clock, cyclic(), statistics, nullptr);
  const TimePoint origin = clock.now();
  sut.begin(origin);
  EXPECT_EQ(sut.due(), origin);
  run_next(sut, milliseconds(1));
  EXPECT_EQ(sut.due(), origin + milliseconds(10));
}

// A debugger halts it: neither the watchdog nor the statistics count the time.
TEST_F(TaskTest, StandsStillInTheMiddleOfACycle) {
  CycleGate gate;
  TaskConfig config = cyclic();
  config.watchdog.time = milliseconds(5);
  Task* task = nullptr;
  config.entry = [&] {
    const auto since = task->trap().running_since();
    clock.run_for(milliseconds(1));
    task->stand_still([&] {
      EXPECT_FALSE(task->in_cycle());
      EXPECT_FALSE(task->trap().running_since());
      EXPECT_FALSE(task->free_since());
      EXPECT_TRUE(task->trap().seat().is_still());
      clock.run_for(milliseconds(75));
    });
    EXPECT_TRUE(task->in_cycle());
    EXPECT_EQ(task->trap().running_since().value(), since.value() + milliseconds(75));
    EXPECT_FALSE(task->trap().seat().is_still());
    clock.run_for(milliseconds(1));
  };
  Task sut(clock, config, statistics, nullptr);
  task = &sut;
  sut.pass(gate);
  sut.begin(clock.now());
  run_next(sut, Duration::zero());
  EXPECT_EQ(counters().exec_last_ns, 2'000'000);
  EXPECT_FALSE(sut.fault().raised());
  EXPECT_EQ(sut.releases_passed(), 7U);  // at 10 ms to 70 ms, of a cycle that ended at 77 ms
  const Activation next = sut.next_release(FreewheelRule({}));
  EXPECT_EQ(next.lost_cycles, 0U);
  EXPECT_EQ(next.release - TimePoint(Duration(counters().release_ns)), milliseconds(80));
}

// Its own time costs releases as in any other cycle.
TEST_F(TaskTest, LosesTheReleasesOfItsOwnTimeAlsoInACycleThatStoodStill) {
  CycleGate gate;
  TaskConfig config = cyclic();
  Task* task = nullptr;
  config.entry = [&] {
    task->stand_still([&] { clock.run_for(milliseconds(20)); });
    clock.run_for(milliseconds(45));
  };
  Task sut(clock, config, statistics, nullptr);
  task = &sut;
  sut.pass(gate);
  sut.begin(clock.now());
  run_next(sut, Duration::zero());
  EXPECT_EQ(sut.releases_passed(), 2U);
  EXPECT_EQ(sut.next_release(FreewheelRule({})).lost_cycles, 4U) << "six lie within its 65 ms";
}

// In a single cycle of a stopped application no other release is planned.
TEST_F(TaskTest, PassesNoReleasesInASingleCycleThatStoodStill) {
  TaskConfig config = cyclic();
  Task* task = nullptr;
  std::uint64_t passing = 0;
  config.entry = [&] {
    task->stand_still([&] {
      clock.run_for(milliseconds(75));
      passing = task->releases_passing(milliseconds(75));
    });
  };
  Task sut(clock, config, statistics, nullptr);
  task = &sut;
  sut.begin(clock.now());
  SingleCycle round(clock);
  const auto source = round.add();
  round.begin();
  sut.run_cycle(source->wait().value());
  EXPECT_EQ(passing, 0U);
  EXPECT_EQ(sut.releases_passed(), 0U);
  sut.begin(clock.now());
  run_next(sut, Duration::zero());
  EXPECT_EQ(passing, 7U);
  EXPECT_EQ(sut.releases_passed(), 7U);
}

// Before the halt, in it and behind it: only those of the halt are told as passed.
TEST_F(TaskTest, LosesNoEdgesThatRiseWhileItStandsStill) {
  TaskConfig config;
  config.kind = TaskKind::event;
  Task* task = nullptr;
  std::uint64_t passing = 0;
  const auto edges = [&](int count) {
    for (int i = 0; i < count; ++i) {
      task->latch()->poll(clock, true, clock.now());
      task->latch()->poll(clock, false, clock.now());
    }
  };
  config.entry = [&] {
    edges(3);  // one run is kept
    task->stand_still([&] {
      edges(5);
      passing = task->releases_passing(milliseconds(75));
    });
    edges(1);
  };
  Task sut(clock, config, statistics, nullptr);
  task = &sut;
  edges(1);
  EXPECT_TRUE(sut.latch()->take());
  sut.run_cycle({.release = clock.now()});
  EXPECT_EQ(passing, 5U);
  EXPECT_EQ(sut.releases_passed(), 5U);
  EXPECT_TRUE(sut.latch()->take());
  EXPECT_EQ(sut.latch()->take_lost(), 3U);
}

}  // namespace
}  // namespace plchost
