#include "schedulers/tick_table.hpp"

#include <deque>

#include <gtest/gtest.h>

#include "schedulers/clock_thread.hpp"
#include "tests/support/manual_clock.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

// Tasks that wait in a table; nothing ticks but the test.
class TickTableTest : public testing::Test {
 protected:
  struct Waiting {
    TaskStatistics statistics{};
    std::unique_ptr<Task> task;
    std::unique_ptr<ActivationSource> source;
    std::vector<Activation> ran;  // read while all threads sleep
    std::atomic<bool> ending{false};
    Thread thread;
  };

  void SetUp() override { sut.start(origin - milliseconds(1)); }

  ~TickTableTest() override {
    clock.run_for(milliseconds(10));  // no cycle is under way any more
    for (auto& waiting : tasks) {
      waiting.ending = true;
      waiting.source->interrupt();
      waiting.thread.join();
    }
  }

  Waiting& add(Duration interval, Duration execution = Duration::zero()) {
    Waiting& waiting = tasks.emplace_back();
    TaskConfig config;
    config.name = "task";
    config.interval = interval;
    config.entry = [this, execution] { clock.spend(execution); };
    waiting.task = std::make_unique<Task>(clock, config, waiting.statistics, nullptr);
    waiting.task->begin(origin);
    waiting.source = sut.add(*waiting.task, FreewheelRule({}));
    auto thread = start_clock_thread(clock, "task", {}, [&waiting] {
      while (!waiting.ending) {
        if (const auto activation = waiting.source->wait()) {
          waiting.ran.push_back(*activation);
          waiting.task->run_cycle(*activation);
        }
      }
    });
    EXPECT_TRUE(thread);
    waiting.thread = std::move(*thread);
    clock.settle();
    return waiting;
  }

  // One tick of the millisecond `n`.
  std::size_t tick(int n) {
    clock.run_until(origin + milliseconds(n));
    const std::size_t released = sut.on_tick(origin + milliseconds(n));
    clock.settle();
    return released;
  }

  ManualClock clock;
  TickTable sut{clock};
  TimePoint origin = clock.now() + milliseconds(2);
  std::deque<Waiting> tasks;
};

TEST_F(TickTableTest, ReleasesNothingBeforeTheOrigin) {
  add(milliseconds(1));
  EXPECT_EQ(sut.on_tick(origin - milliseconds(1)), 0U);
}

TEST_F(TickTableTest, ReleasesAllThatIsDueAtTheSameTick) {
  constexpr int kTasks = 40;
  for (int i = 1; i <= kTasks; ++i) add(milliseconds(i));
  for (int n = 0; n < 100; ++n) {
    std::size_t due = 0;
    for (int i = 1; i <= kTasks; ++i) due += n % i == 0 ? 1U : 0U;
    ASSERT_EQ(tick(n), due) << "tick " << n;
  }
}

TEST_F(TickTableTest, SameTickTwiceReleasesNothingTwice) {
  Waiting& task = add(milliseconds(1));
  EXPECT_EQ(tick(0), 1U);
  EXPECT_EQ(tick(0), 0U);
  EXPECT_EQ(task.ran.size(), 1U);
}

TEST_F(TickTableTest, IntervalThatIsNoMultipleOfTheTickKeepsItsGrid) {
  Waiting& task = add(microseconds(1500));
  for (int n = 0; n <= 6; ++n) tick(n);
  // Nominal 0, 1.5, 3, 4.5, 6 ms: released at the first tick not before.
  ASSERT_EQ(task.ran.size(), 5U);
  for (std::size_t i = 0; i < task.ran.size(); ++i) {
    EXPECT_EQ(task.ran[i].release, origin + static_cast<Duration::rep>(i) * microseconds(1500));
    EXPECT_EQ(task.ran[i].lost_cycles, 0U);
  }
}

TEST_F(TickTableTest, BusyTaskLosesItsTick) {
  Waiting& task = add(milliseconds(1), microseconds(2500));
  for (int n = 0; n <= 5; ++n) tick(n);
  ASSERT_EQ(task.ran.size(), 2U);
  EXPECT_EQ(task.ran[1].release, origin + milliseconds(3));
  EXPECT_EQ(task.ran[1].lost_cycles, 2U);
}

TEST_F(TickTableTest, TicksThatNeverCameMakeTheTaskLateAndThenLoseCycles) {
  Waiting& task = add(milliseconds(1));
  tick(0);
  EXPECT_EQ(tick(4), 1U);
  ASSERT_EQ(task.ran.size(), 3U);
  EXPECT_EQ(task.ran[1].release, origin + milliseconds(1)) << "it was ready, so it is late, not lost";
  EXPECT_EQ(task.ran[2].release, origin + milliseconds(4));
  EXPECT_EQ(task.ran[2].lost_cycles, 2U);
}

TEST_F(TickTableTest, TaskThatComesBackAfterItsTickRunsAtOnce) {
  tick(3);
  Waiting& task = add(milliseconds(10));
  ASSERT_EQ(task.ran.size(), 1U);
  EXPECT_EQ(task.ran[0].release, origin);
}

}  // namespace
}  // namespace plchost
