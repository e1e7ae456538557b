// How tasks come to rest: the two phases of a stop, and the single cycle.
#include <atomic>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "tests/conformance/scheduler_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::IsEmpty;

class Stop : public testing::TestWithParam<std::string_view> {
 protected:
  /// A cycle that waits until it is let go.
  struct Holder {
    std::atomic<bool> let_go{false};
    std::atomic<int> inside{0};
    std::atomic<int> held{0};
    void hold() {
      ++inside;
      if (let_go) return;
      ++held;
      while (!let_go) std::this_thread::sleep_for(milliseconds(1));
    }
  };

  ~Stop() override { release(); }
  void release() {
    for (Holder* holder : {&output_, &other_}) holder->let_go = true;
  }
  void add(const std::string& name, bool drives_outputs, std::function<void()> entry) {
    TaskConfig config = Tasks<LinuxClock>::cyclic(name, milliseconds(1), std::move(entry));
    config.drives_outputs = drives_outputs;
    tasks_.add(std::move(config));
  }
  void start() {
    ASSERT_TRUE(tasks_.create());
    ASSERT_TRUE(tasks_.set->start(GetParam(), {}));
  }
  static void wait_for(const std::function<bool()>& condition) {
    while (!condition()) std::this_thread::sleep_for(milliseconds(1));
  }
  std::vector<std::size_t> finish_stop() {
    for (;;) {
      if (auto stuck = tasks_.set->advance_stop()) return *stuck;
      std::this_thread::sleep_for(milliseconds(1));
    }
  }

  Holder output_;
  Holder other_;
  Tasks<LinuxClock> tasks_;
};

INSTANTIATE_TEST_SUITE_P(Schedulers, Stop, testing::ValuesIn(every_scheduler()), scheduler_test_name);

TEST_P(Stop, LetsTheOthersRunUntilTasksThatDriveOutputsHaveParked) {
  std::atomic<int> cycles{0};
  add("Output", true, [this] { output_.hold(); });
  add("Other", false, [&] { ++cycles; });
  start();
  wait_for([&] { return output_.inside > 0; });
  ASSERT_TRUE(tasks_.set->begin_stop({.outputs = seconds(100), .others = seconds(100)}));
  const int before = cycles;
  wait_for([&] {
    EXPECT_FALSE(tasks_.set->advance_stop());
    return cycles > before + 10;
  });
  EXPECT_TRUE(tasks_.set->running());
  output_.let_go = true;
  EXPECT_THAT(finish_stop(), IsEmpty());
  EXPECT_FALSE(tasks_.set->running());
  EXPECT_EQ(output_.inside, 1);
  const int parked = cycles;
  std::this_thread::sleep_for(milliseconds(20));
  EXPECT_EQ(cycles, parked);
}

TEST_P(Stop, TellsOfATaskThatItIsToParkWhenItsPhaseBegins) {
  std::vector<std::size_t> told;
  tasks_.to_park = [&](std::size_t task) { told.push_back(task); };
  add("Output", true, [this] { output_.hold(); });
  add("Other", false, [] {});
  add("Second", true, [] {});
  start();
  wait_for([&] { return output_.inside > 0; });
  EXPECT_THAT(told, IsEmpty());
  ASSERT_TRUE(tasks_.set->begin_stop({.outputs = seconds(100), .others = seconds(100)}));
  EXPECT_THAT(told, ElementsAre(0, 2));
  EXPECT_FALSE(tasks_.set->advance_stop());
  EXPECT_THAT(told, ElementsAre(0, 2));
  output_.let_go = true;
  EXPECT_THAT(finish_stop(), IsEmpty());
  EXPECT_THAT(told, ElementsAre(0, 2, 1));
}

TEST_P(Stop, GoesOnWithoutATaskThatDoesNotComeBack) {
  add("Output", true, [this] { output_.hold(); });
  add("Other", false, [this] { other_.hold(); });
  add("Good", false, [] {});
  start();
  wait_for([&] { return output_.inside > 0 && other_.inside > 0; });
  ASSERT_TRUE(tasks_.set->begin_stop({.outputs = milliseconds(20), .others = milliseconds(20)}));
  const auto stuck = finish_stop();
  EXPECT_THAT(stuck, ElementsAre(0, 1));
  EXPECT_EQ(tasks_.set->names_of(stuck), "Output, Other");
  const auto again = tasks_.set->start(GetParam(), {});
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::wrong_state);
  EXPECT_THAT(again.error().message, testing::HasSubstr("Output, Other"));
  release();
  wait_for([&] { return tasks_.set->start(GetParam(), {}).has_value(); });
  EXPECT_TRUE(tasks_.set->stop(seconds(100)));
}

TEST_P(Stop, CountsItsTimeFromWhenTheLastTaskWasAsked) {
  tasks_.to_park = [](std::size_t) {
    std::this_thread::sleep_for(milliseconds(30));
  };  // the host stands still
  for (const std::string name : {"A", "B", "C"}) add("Output" + name, true, [] {});
  for (const std::string name : {"A", "B", "C"}) add("Other" + name, false, [] {});
  start();
  ASSERT_TRUE(tasks_.set->begin_stop({.outputs = milliseconds(50), .others = milliseconds(50)}));
  EXPECT_THAT(finish_stop(), IsEmpty());
}

TEST_P(Stop, FindsNoIdleTaskStuckHoweverLateItLooks) {
  for (int i = 0; i < 20; ++i) add("Task" + std::to_string(i), i % 2 == 0, [] {});
  start();
  for (int round = 0; round < 20; ++round) {
    ASSERT_TRUE(tasks_.set->begin_stop({.outputs = Duration::zero(), .others = Duration::zero()}));
    EXPECT_THAT(finish_stop(), IsEmpty());
    ASSERT_TRUE(tasks_.set->start(GetParam(), {}));
  }
}

TEST_P(Stop, WaitsLongerForATaskThatIsInNoCycle) {
  TaskConfig config = Tasks<LinuxClock>::cyclic("Idle", milliseconds(1), [] {});
  config.after_cycle = [this](const TaskCounters&) { other_.hold(); };  // as if it did not get the processor
  tasks_.add(std::move(config));
  start();
  wait_for([&] { return other_.inside > 0; });
  constexpr int kRounds = 20;  // in one of them, this thread does not stand still for as long as it waits
  for (int round = 1; round <= kRounds; ++round) {
    const TimePoint begun = MonotonicClock::now();
    ASSERT_TRUE(tasks_.set->begin_stop({.outputs = milliseconds(1), .others = milliseconds(1)}));
    std::optional<std::vector<std::size_t>> stuck;
    while (!stuck && MonotonicClock::now() < begun + milliseconds(300)) {
      stuck = tasks_.set->advance_stop();
      std::this_thread::sleep_for(milliseconds(1));
    }
    const Duration looked = MonotonicClock::now() - begun;
    other_.let_go = true;
    if (!stuck) stuck = finish_stop();
    if (stuck->empty()) return;
    ASSERT_GE(looked, TaskSet::kIdlePatience) << "it waited less";
    wait_for([&] { return tasks_.set->still_busy(TimePoint{}).empty(); });
    other_.let_go = false;
    const int before = other_.inside;
    wait_for([&] { return tasks_.set->start(GetParam(), {}).has_value(); });
    wait_for([&] { return other_.inside > before; });
  }
  FAIL() << "no round was looked at in time";
}

TEST_P(Stop, BlamesNoIdleTaskForOneThatKeepsTheProcessorFromIt) {
  TaskConfig config = Tasks<LinuxClock>::cyclic("Idle", milliseconds(1), [] {});
  config.after_cycle = [this](const TaskCounters&) { other_.hold(); };
  tasks_.add(std::move(config));
  add("Endless", false, [this] { output_.hold(); });
  start();
  wait_for([&] { return other_.inside > 0 && output_.inside > 0; });
  ASSERT_TRUE(tasks_.set->begin_stop({.outputs = milliseconds(1), .others = milliseconds(1)}));
  EXPECT_THAT(finish_stop(), ElementsAre(1));
  EXPECT_THAT(tasks_.set->still_busy(TimePoint{}), ElementsAre("Idle", "Endless"));
}

TEST_P(Stop, BlamesTheVariableForTasksOfTheFirstPhaseThatItKeepsTheProcessorFrom) {
  TaskConfig config = Tasks<LinuxClock>::cyclic("Idle", milliseconds(1), [] {});
  config.drives_outputs = true;
  config.after_cycle = [this](const TaskCounters&) { output_.hold(); };
  tasks_.add(std::move(config));
  tasks_.add(Tasks<LinuxClock>::event("Edge", [&] { return other_.hold(), false; }, [] {}));
  other_.let_go = true;
  start();
  other_.let_go = false;
  wait_for([&] { return output_.inside > 0 && other_.held > 0; });
  ASSERT_TRUE(tasks_.set->begin_stop({.outputs = milliseconds(1), .others = milliseconds(1)}));
  EXPECT_THAT(finish_stop(), ElementsAre(1));
  EXPECT_EQ(tasks_.set->late_variable(), 1U);
}

TEST_P(Stop, GivesUpOnATaskThatNeverGetsTheProcessor) {
  TaskConfig config = Tasks<LinuxClock>::cyclic("Idle", milliseconds(1), [] {});
  config.after_cycle = [this](const TaskCounters&) { other_.hold(); };
  tasks_.add(std::move(config));
  start();
  wait_for([&] { return other_.inside > 0; });
  const TimePoint begun = MonotonicClock::now();
  ASSERT_TRUE(tasks_.set->begin_stop({.outputs = milliseconds(1), .others = milliseconds(1)}));
  EXPECT_THAT(finish_stop(), ElementsAre(0));
  EXPECT_GE(MonotonicClock::now() - begun, TaskSet::kIdlePatience);
}

TEST_P(Stop, GoesOnWithoutAnEventVariableThatDoesNotReturn) {
  std::atomic<bool> endless{false};
  add("Good", true, [] {});
  tasks_.add(Tasks<LinuxClock>::event("Fine", [] { return false; }, [] {}));
  tasks_.add(
      Tasks<LinuxClock>::event("Edge", [&] { return (endless ? other_.hold() : void()), false; }, [] {}));
  start();
  endless = true;
  wait_for([&] { return other_.inside > 0; });
  ASSERT_TRUE(tasks_.set->begin_stop({.outputs = milliseconds(20), .others = milliseconds(50)}));
  EXPECT_THAT(finish_stop(), ElementsAre(2));
  EXPECT_EQ(tasks_.set->late_variable(), 2U);
  wait_for([&] { return tasks_.set->still_busy(TimePoint{}).size() == 1; });
  EXPECT_THAT(tasks_.set->still_busy(TimePoint{}), ElementsAre("Edge"));
  const auto again = tasks_.set->start(GetParam(), {});
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::wrong_state);
  EXPECT_THAT(again.error().message, testing::HasSubstr("Edge"));
  endless = false;
  release();
  wait_for([&] { return tasks_.set->start(GetParam(), {}).has_value(); });
  EXPECT_TRUE(tasks_.set->stop(seconds(100)));
  EXPECT_EQ(tasks_.set->late_variable(), std::nullopt);
}

TEST_P(Stop, WaitsForAnEventVariableThatReturnsInTime) {
  tasks_.add(Tasks<LinuxClock>::event("Edge", [&] { return other_.hold(), false; }, [] {}));
  other_.let_go = true;
  start();
  other_.let_go = false;
  wait_for([&] { return other_.held > 0; });
  ASSERT_TRUE(tasks_.set->begin_stop({.outputs = seconds(100), .others = seconds(100)}));
  for (int look = 0; look < 50; ++look) {
    ASSERT_FALSE(tasks_.set->advance_stop());
    std::this_thread::sleep_for(milliseconds(1));
  }
  release();
  EXPECT_THAT(finish_stop(), IsEmpty());
}

TEST_P(Stop, WithoutWaitingLeavesAnEventVariableAlone) {
  tasks_.add(Tasks<LinuxClock>::event("Edge", [&] { return other_.hold(), false; }, [] {}));
  other_.let_go = true;
  start();
  other_.let_go = false;
  wait_for([&] { return other_.held > 0; });
  tasks_.set->park_all();
  EXPECT_FALSE(tasks_.set->running());
  EXPECT_THAT(tasks_.set->still_busy(TimePoint{}), ElementsAre("Edge"));
  release();
  EXPECT_THAT(tasks_.set->still_busy(MonotonicClock::now() + seconds(100)), IsEmpty());
}

class EndlessVariable : public Stop {
 protected:
  void expect_exception() {
    const auto fault = tasks_.set->take_fault();
    ASSERT_TRUE(fault);
    EXPECT_EQ(fault->name, "Edge");
    EXPECT_TRUE(fault->whole_application);
    EXPECT_THAT(describe_fault(fault->record), testing::HasSubstr("still running in its event variable"));
    tasks_.set->park_all();
    EXPECT_FALSE(tasks_.set->start(GetParam(), {}));
  }
};

INSTANTIATE_TEST_SUITE_P(Schedulers, EndlessVariable, testing::ValuesIn(every_scheduler()),
                         scheduler_test_name);

TEST_P(EndlessVariable, IsAFaultWhenItIsReadForTheFirstTime) {
  add("Good", true, [] {});
  tasks_.add(Tasks<LinuxClock>::event("Edge", [&] { return other_.hold(), false; }, [] {}));
  start();
  expect_exception();
}

TEST_P(EndlessVariable, IsAFaultInASwitch) {
  tasks_.add(Tasks<LinuxClock>::event("Edge", [&] { return other_.hold(), false; }, [] {}));
  other_.let_go = true;
  start();
  other_.let_go = false;
  wait_for([&] { return other_.held > 0; });
  const auto switched = tasks_.set->switch_to("CmpSchedule", {});
  ASSERT_FALSE(switched);
  EXPECT_EQ(switched.error().code, ErrorCode::timed_out);
  EXPECT_THAT(switched.error().message, testing::HasSubstr("Edge"));
  expect_exception();
}

TEST_P(Stop, IsRefusedWhileTheTasksAreStopped) {
  add("Good", true, [] {});
  start();
  ASSERT_TRUE(tasks_.set->stop(seconds(100)));
  EXPECT_EQ(tasks_.set->begin_stop({}).error().code, ErrorCode::wrong_state);
}

TEST_P(Stop, RefusesAnotherStopAndASwitchWhileItGoesOn) {
  add("Output", true, [this] { output_.hold(); });
  start();
  wait_for([&] { return output_.inside > 0; });
  ASSERT_TRUE(tasks_.set->begin_stop({}));
  EXPECT_EQ(tasks_.set->begin_stop({}).error().code, ErrorCode::wrong_state);
  EXPECT_EQ(tasks_.set->switch_to("CmpSchedule", {}).error().code, ErrorCode::wrong_state);
  EXPECT_EQ(tasks_.set->start("CmpSchedule", {}).error().code, ErrorCode::wrong_state);
  release();
  EXPECT_THAT(finish_stop(), IsEmpty());
}

class SingleCycleOfTasks : public testing::Test {
 protected:
  void add(TaskConfig config, int priority) {
    const std::string name = config.name;
    config.iec_priority = priority;
    config.entry = [this, name] {
      const std::lock_guard lock(mutex_);
      ran_.push_back(name);
    };
    tasks_.add(std::move(config));
  }
  void run_single_cycle() {
    const auto begun = tasks_.set->begin_single_cycle({});
    ASSERT_TRUE(begun) << begun.error().describe();
    while (!tasks_.set->single_cycle_done()) std::this_thread::sleep_for(milliseconds(1));
    EXPECT_TRUE(tasks_.set->stop(seconds(100)));
  }

  std::mutex mutex_;
  std::vector<std::string> ran_;
  Tasks<LinuxClock> tasks_;
};

TEST_F(SingleCycleOfTasks, RunsEachCyclicAndFreewheelingTaskOnceByPriority) {
  using T = Tasks<LinuxClock>;
  add(T::cyclic("Slow", seconds(100), {}), 20);
  add(T::freewheeling("Loop", {}), 5);
  add(T::cyclic("Fast", milliseconds(1), {}), 1);
  add(T::external("Work", "work", {}), 0);
  add(T::event("Edge", [] { return true; }, {}), 0);
  add(T::cyclic("Same", milliseconds(1), {}), 5);
  ASSERT_TRUE(tasks_.create());
  tasks_.event_named("work").post();
  run_single_cycle();
  EXPECT_THAT(ran_, ElementsAre("Fast", "Loop", "Same", "Slow"));
  run_single_cycle();
  EXPECT_EQ(ran_.size(), 8U);
  EXPECT_EQ(tasks_.counters(0).cycles, 2U);
  EXPECT_EQ(tasks_.counters(2).lost_cycles, 0U);
  EXPECT_EQ(tasks_.counters(2).jitter_max_ns, 0);
}

TEST_F(SingleCycleOfTasks, ComesBetweenTwoRunsUnderEachScheduler) {
  using T = Tasks<LinuxClock>;
  add(T::cyclic("Fast", milliseconds(1), {}), 1);
  ASSERT_TRUE(tasks_.create());
  for (const std::string_view scheduler : every_scheduler()) {
    const std::uint64_t before = tasks_.counters(0).cycles;
    run_single_cycle();
    EXPECT_EQ(tasks_.counters(0).cycles, before + 1);
    ASSERT_TRUE(tasks_.set->start(scheduler, {}));
    EXPECT_EQ(tasks_.set->begin_single_cycle({}).error().code, ErrorCode::wrong_state);
    tasks_.wait_for_cycles(0, before + 10);
    ASSERT_TRUE(tasks_.set->stop(seconds(100)));
  }
}

TEST_F(SingleCycleOfTasks, TellsThatItWillRunBeforeTheFirstCycleAndOnlyThen) {
  using T = Tasks<LinuxClock>;
  add(T::cyclic("Fast", milliseconds(1), {}), 1);
  ASSERT_TRUE(tasks_.create());
  int told = 0;
  const auto before = [&] {
    ++told;
    EXPECT_EQ(tasks_.counters(0).cycles, 0U);
  };
  ASSERT_TRUE(tasks_.set->begin_single_cycle({}, before));
  EXPECT_EQ(told, 1);
  EXPECT_EQ(tasks_.set->begin_single_cycle({}, before).error().code, ErrorCode::wrong_state);
  EXPECT_EQ(told, 1) << "it was refused";
  ASSERT_TRUE(tasks_.set->stop(seconds(100)));
}

TEST_F(SingleCycleOfTasks, ThatIsStoppedNamesTheTasksThatHadNoTurn) {
  using T = Tasks<LinuxClock>;
  std::atomic<bool> inside{false}, let_go{false};
  TaskConfig held = T::cyclic("Held", milliseconds(1), [&] {
    inside = true;
    while (!let_go) std::this_thread::sleep_for(milliseconds(1));
  });
  held.iec_priority = 1;
  tasks_.add(std::move(held));
  add(T::cyclic("Last", milliseconds(1), {}), 3);
  add(T::cyclic("Next", milliseconds(1), {}), 2);
  ASSERT_TRUE(tasks_.create());
  ASSERT_TRUE(tasks_.set->begin_single_cycle({}));
  while (!inside) std::this_thread::sleep_for(milliseconds(1));
  ASSERT_TRUE(tasks_.set->begin_stop({.outputs = seconds(100), .others = seconds(100)}));
  let_go = true;
  while (!tasks_.set->advance_stop()) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(tasks_.set->names_of(tasks_.set->left_out()), "Next, Last");
  run_single_cycle();
  EXPECT_THAT(tasks_.set->left_out(), IsEmpty());
}

TEST_F(SingleCycleOfTasks, WithoutSuchATaskIsDoneAtOnce) {
  add(Tasks<LinuxClock>::external("Work", "work", {}), 0);
  ASSERT_TRUE(tasks_.create());
  run_single_cycle();
  EXPECT_THAT(ran_, IsEmpty());
}

}  // namespace
}  // namespace plchost
