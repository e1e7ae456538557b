#include "schedulers/tasks/task_recorder.hpp"

#include <atomic>
#include <cstring>
#include <thread>

#include <gtest/gtest.h>

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr TimePoint kFirstRelease{seconds(100)};

class Recorder : public testing::Test {
 protected:
  using enum TaskHistogram;

  static constexpr Duration kInterval = milliseconds(10);

  /// Waits for a writer that was taken off its processor in the middle.
  [[nodiscard]] TaskCounters read() const {
    for (;; std::this_thread::yield()) {
      if (const auto counters = statistics_.counters.read()) return *counters;
    }
  }

  /// The cycle of release number `n`.
  static RecordedCycle cycle(int n, Duration latency = {}, Duration execution = milliseconds(1)) {
    RecordedCycle made;
    made.release = kFirstRelease + n * kInterval;
    made.start = made.release + latency;
    made.end = made.start + execution;
    made.interval = kInterval;
    return made;
  }

  TaskStatistics statistics_{HistogramShape::kFine};
  TaskRecorder sut_{statistics_, kFirstRelease};
};

TEST_F(Recorder, ShowsSinceWhenItCountsBeforeTheFirstCycle) {
  EXPECT_EQ(read().since_ns, kFirstRelease.time_since_epoch().count());
  EXPECT_GT(read().since_unix_ns, 0);
  EXPECT_EQ(read().cycles, 0U);
}

TEST_F(Recorder, LatencyHasLastLeastGreatestAndSum) {
  for (const int us : {30, 70, 10}) sut_.record(cycle(0, microseconds(us)));
  EXPECT_EQ(read().latency_last_ns, 10'000);
  EXPECT_EQ(read().latency_min_ns, 10'000);
  EXPECT_EQ(read().latency_max_ns, 70'000);
  EXPECT_EQ(average(read().latency_sum_ns, read().recorded), 110'000 / 3);
  EXPECT_EQ(statistics_[latency].total(), 3U);
  EXPECT_EQ(statistics_[latency].count(statistics_[latency].shape().index_of(microseconds(70))), 1U);
}

TEST_F(Recorder, ExecutionHasLastLeastGreatestAndSum) {
  for (const int us : {3, 7, 1}) sut_.record(cycle(0, {}, microseconds(us)));
  EXPECT_EQ(read().exec_last_ns, 1'000);
  EXPECT_EQ(read().exec_min_ns, 1'000);
  EXPECT_EQ(read().exec_max_ns, 7'000);
  EXPECT_EQ(read().exec_sum_ns, 11'000);
  EXPECT_EQ(statistics_[execution].total(), 3U);
}

TEST_F(Recorder, PeriodJitterLiesInOneHistogramForEachSign) {
  const Duration latencies[] = {microseconds(50), microseconds(10), microseconds(30), microseconds(30)};
  int n = 0;
  for (const Duration late : latencies) sut_.record(cycle(n++, late));
  EXPECT_EQ(read().periods, 3U) << "four starts are three periods";
  EXPECT_EQ(read().jitter_last_ns, 0);
  EXPECT_EQ(read().jitter_min_ns, -40'000);
  EXPECT_EQ(read().jitter_max_ns, 20'000);
  EXPECT_EQ(read().jitter_sum_ns, -20'000);
  EXPECT_EQ(largest_jitter_ns(read()), 40'000);
  EXPECT_EQ(statistics_[jitter_negative].total(), 1U);
  EXPECT_EQ(statistics_[jitter_negative].count(statistics_[latency].shape().index_of(microseconds(40))), 1U);
  EXPECT_EQ(statistics_[jitter_positive].total(), 2U);
  EXPECT_EQ(statistics_[jitter_positive].count(0), 1U) << "no deviation";
}

TEST_F(Recorder, TellsForWhichPostTheLastCycleWasAlsoAfterAReset) {
  RecordedCycle one = cycle(0);
  one.posts_done = 7;
  sut_.record(one);
  EXPECT_EQ(read().posts_done, 7U);
  ASSERT_TRUE(sut_.reset(TimePoint(milliseconds(5))));
  EXPECT_EQ(read().posts_done, 7U);
}

TEST_F(Recorder, TellsWhichPostsWereLostLastAlsoAfterAReset) {
  RecordedCycle one = cycle(0);
  one.posts_done = 9;
  one.lost_events = 3;
  sut_.record(one);
  EXPECT_EQ(read().posts_lost_first, 6U);
  EXPECT_EQ(read().posts_lost_last, 8U);
  one.posts_done = 10;
  one.lost_events = 0;
  sut_.record(one);
  ASSERT_TRUE(sut_.reset(TimePoint(milliseconds(5))));
  EXPECT_EQ(read().posts_lost_last, 8U);
  sut_.lose_posts(14);
  EXPECT_EQ(read().posts_lost_first, 11U);
  EXPECT_EQ(read().posts_lost_last, 14U);
}

TEST_F(Recorder, OnlyCyclicTasksHaveJitterAndSlots) {
  for (int n = 0; n < 3; ++n) {
    RecordedCycle one = cycle(n, microseconds(n), milliseconds(50));
    one.interval = Duration::zero();
    sut_.record(one);
  }
  EXPECT_EQ(read().periods, 0U);
  EXPECT_EQ(read().slots_max, 0U);
  EXPECT_EQ(statistics_[jitter_negative].total() + statistics_[jitter_positive].total(), 0U);
}

TEST_F(Recorder, TheTimeBeforeBeginIsNoPeriod) {
  sut_.record(cycle(0));
  sut_.begin();
  sut_.record(cycle(100, milliseconds(3)));
  EXPECT_EQ(read().periods, 0U);
}

TEST_F(Recorder, SlotsAreThePeriodsThatACycleTouched) {
  auto slots = [&, n = 0](Duration late, Duration busy) mutable {
    sut_.record(cycle(n++, late, busy));
    return read().slots_last;
  };
  EXPECT_EQ(slots({}, Duration::zero()), 1U);
  EXPECT_EQ(slots({}, kInterval), 1U) << "in time for the next release";
  EXPECT_EQ(slots({}, kInterval + Duration(1)), 2U);
  EXPECT_EQ(slots(milliseconds(9), milliseconds(2)), 2U) << "counted from the planned release";
  EXPECT_EQ(slots({}, 3 * kInterval + Duration(1)), 4U);
  EXPECT_EQ(slots({}, milliseconds(1)), 1U);
  EXPECT_EQ(read().slots_max, 4U);
}

TEST_F(Recorder, LostCyclesCountInAllAndInARow) {
  for (const unsigned lost : {0U, 2U, 5U, 0U, 3U}) {
    RecordedCycle one = cycle(0);
    one.lost_cycles = lost;
    one.lost_events = 1;
    sut_.record(one);
  }
  EXPECT_EQ(read().lost_cycles, 10U);
  EXPECT_EQ(read().lost_consecutive, 3U);
  EXPECT_EQ(read().lost_consecutive_max, 5U);
  EXPECT_EQ(read().lost_events, 5U);
  sut_.record(cycle(1));
  EXPECT_EQ(read().lost_consecutive, 0U);
}

TEST_F(Recorder, LastLossNamesTheCycleThatWasInTheWay) {
  const auto ns = [](TimePoint time) { return time.time_since_epoch().count(); };
  const RecordedCycle slow = cycle(0, microseconds(30), milliseconds(25));
  sut_.record(slow);
  EXPECT_EQ(read().last_loss.lost, 0U);
  RecordedCycle next = cycle(3);
  next.lost_cycles = 2;
  next.ready = slow.end + milliseconds(1);
  sut_.record(next);
  sut_.record(cycle(4));
  EXPECT_EQ(read().last_loss.lost, 2U) << "kept until the next loss";
  EXPECT_EQ(read().last_loss.release_ns, ns(slow.release));
  EXPECT_EQ(read().last_loss.start_ns, ns(slow.start));
  EXPECT_EQ(read().last_loss.end_ns, ns(next.ready)) << "with the runtime's work behind the cycle";
  sut_.begin();
  RecordedCycle first = cycle(9);
  first.lost_cycles = 1;
  first.ready = first.release;
  sut_.record(first);
  EXPECT_EQ(read().last_loss.release_ns, 0) << "no cycle has run since the start";
  EXPECT_EQ(read().last_loss.end_ns, ns(first.release));
  ASSERT_TRUE(sut_.reset(first.end));
  EXPECT_EQ(read().last_loss.lost, 0U);
}

TEST_F(Recorder, ResetBeginsAllAnewButTheCycleCountAndTheInterval) {
  for (int n = 0; n < 5; ++n) {
    RecordedCycle one = cycle(n, microseconds(10 * (n + 1)), milliseconds(25));
    one.lost_cycles = 2;
    one.spun = microseconds(7);
    sut_.record(one);
  }
  const TimePoint later = kFirstRelease + seconds(1);
  ASSERT_TRUE(sut_.reset(later));
  const auto is_fresh = [&](std::uint64_t cycles) {
    TaskCounters expected{};
    expected.cycles = cycles;
    expected.interval_ns = kInterval.count();
    expected.since_ns = later.time_since_epoch().count();
    expected.since_unix_ns = read().since_unix_ns;
    const TaskCounters now = read();
    return std::memcmp(&now, &expected, sizeof now) == 0;
  };
  EXPECT_TRUE(is_fresh(5)) << "at once, also while the task is parked";
  for (const DurationHistogram& histogram : statistics_.histograms) {
    EXPECT_EQ(histogram.total(), 0U);
  }
  sut_.record(cycle(6, microseconds(3)));
  EXPECT_EQ(read().cycles, 6U);
  EXPECT_EQ(read().recorded, 1U);
  EXPECT_EQ(read().latency_max_ns, 3'000);
  EXPECT_EQ(read().latency_min_ns, 3'000);
  EXPECT_EQ(read().lost_cycles, 0U);
  EXPECT_EQ(read().spin_sum_ns, 0);
  EXPECT_EQ(read().since_ns, later.time_since_epoch().count());
}

// Threads, so that a reset comes in the middle of a record, too.
TEST_F(Recorder, ResetWhileItRecordsLeavesNothingOfBefore) {
  std::atomic<bool> stop{false};
  std::atomic<int> number{0};
  std::jthread task([&] {
    int n = 0;
    while (!stop.load()) {
      // The latency tells between which two resets the cycle was.
      sut_.record(cycle(n, microseconds(100 * (number.load() + 1))));
      // A reader needs a moment without a writer.
      if (++n % 4 == 0) std::this_thread::sleep_for(microseconds(1));
    }
  });
  for (int i = 1; i <= 200; ++i) {
    number = i;
    // A cycle that has read the number before is done when two more are.
    for (const std::uint64_t now = read().cycles; read().cycles < now + 2;) std::this_thread::yield();
    while (!sut_.reset(kFirstRelease + seconds(i))) std::this_thread::yield();
    for (const std::uint64_t now = read().cycles; read().cycles < now + 2;) std::this_thread::yield();
    EXPECT_EQ(read().latency_min_ns, 100'000 * (i + 1));
    EXPECT_EQ(statistics_[latency].percentile(0), statistics_[latency].percentile(1.0));
  }
  stop = true;
  task.join();
  const std::uint64_t recorded = read().recorded;
  EXPECT_EQ(statistics_[latency].total(), recorded) << "scalars and buckets tell of the same cycles";
  EXPECT_EQ(statistics_[execution].total(), recorded);
  EXPECT_EQ(statistics_[jitter_negative].total() + statistics_[jitter_positive].total(), read().periods);
  EXPECT_EQ(read().cycles, sut_.counters().cycles);
  EXPECT_EQ(sut_.counters().cycles,
            static_cast<std::uint64_t>(read().release_ns - kFirstRelease.time_since_epoch().count()) /
                    static_cast<std::uint64_t>(kInterval.count()) +
                1)
      << "none is missing in the cycle count";
}

}  // namespace
}  // namespace plchost
