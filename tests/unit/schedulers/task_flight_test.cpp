// How a task tells of its cycles in the flight recorder.
#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "schedulers/tasks/task.hpp"
#include "tests/support/manual_clock.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

class TaskInTheFlightRecorder : public testing::Test {
 protected:
  TaskConfig cyclic() {
    TaskConfig config;
    config.name = "main";
    config.interval = milliseconds(10);
    config.entry = [this] {
      in_code = Task::flight_here();
      clock.run_for(execution);
    };
    return config;
  }
  void run_next(Task& sut, Duration latency) {
    const Activation activation = sut.next_release(FreewheelRule({}));
    clock.run_until(activation.release + latency);
    sut.run_cycle(activation);
  }
  std::vector<FlightEntry> entries() { return FlightRing::read(written, words, 0).entries; }

  ManualClock clock;
  TaskStatistics statistics{};
  Duration execution = milliseconds(2);
  FlightRing::Word written{0};
  std::array<FlightRing::Word, 64 * FlightRing::kWordsOfEntry> words{};
  FlightRing* in_code = nullptr;
};

TEST_F(TaskInTheFlightRecorder, TellsStartAndEndOfEachCycle) {
  Task sut(clock, cyclic(), statistics, nullptr);
  sut.tell_in(FlightRing(written, words));
  sut.begin(clock.now());
  const TimePoint origin = clock.now();
  run_next(sut, microseconds(30));
  const auto told = entries();
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].kind, FlightKind::start);
  EXPECT_EQ(told[0].figure, 30'000) << "since the planned release";
  EXPECT_EQ(TimePoint(Duration(told[0].time_ns)), origin + microseconds(30));
  EXPECT_EQ(told[1].kind, FlightKind::end);
  EXPECT_EQ(told[1].time_ns - told[0].time_ns, 2'000'000);
}

TEST_F(TaskInTheFlightRecorder, TellsLostReleasesBeforeTheCycleThatComesAfterThem) {
  Task sut(clock, cyclic(), statistics, nullptr);
  sut.tell_in(FlightRing(written, words));
  sut.begin(clock.now());
  execution = milliseconds(35);
  run_next(sut, Duration::zero());
  execution = milliseconds(1);
  run_next(sut, Duration::zero());
  const auto told = entries();
  ASSERT_EQ(told.size(), 5U);
  EXPECT_EQ(told[2].kind, FlightKind::lost);
  EXPECT_EQ(told[2].figure, 3);
  EXPECT_EQ(told[3].kind, FlightKind::start);
}

TEST_F(TaskInTheFlightRecorder, TellsTheTimeInWhichADebuggerHoldsItsCode) {
  Task* self = nullptr;
  TaskConfig config = cyclic();
  config.entry = [&] { self->stand_still([&] { clock.run_for(milliseconds(3)); }); };
  Task sut(clock, config, statistics, nullptr);
  self = &sut;
  sut.tell_in(FlightRing(written, words));
  sut.begin(clock.now());
  run_next(sut, Duration::zero());
  const auto told = entries();
  ASSERT_EQ(told.size(), 4U);
  EXPECT_EQ(told[1].kind, FlightKind::halted);
  EXPECT_EQ(told[2].kind, FlightKind::resumed);
  EXPECT_EQ(told[2].time_ns - told[1].time_ns, 3'000'000);
}

TEST_F(TaskInTheFlightRecorder, CodeOfATaskFindsItsRingAndNobodyElseDoes) {
  Task sut(clock, cyclic(), statistics, nullptr);
  sut.tell_in(FlightRing(written, words));
  sut.begin(clock.now());
  run_next(sut, Duration::zero());
  EXPECT_NE(in_code, nullptr);
  EXPECT_EQ(Task::flight_here(), nullptr);
}

TEST_F(TaskInTheFlightRecorder, WithoutARingATaskRunsAsWell) {
  Task sut(clock, cyclic(), statistics, nullptr);
  sut.begin(clock.now());
  run_next(sut, Duration::zero());
  EXPECT_EQ(statistics.counters.read()->cycles, 1U);
  EXPECT_EQ(written.load(), 0U);
}

}  // namespace
}  // namespace plchost
