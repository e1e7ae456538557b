#include "schedulers/tick/tick_table.hpp"

#include <deque>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "schedulers/clock/clock.hpp"
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
    clock.run_for(std::chrono::seconds(10));  // no cycle is under way any more
    for (auto& waiting : tasks) {
      waiting.ending = true;
      waiting.source->interrupt();
      waiting.thread.join();
    }
  }

  Waiting& add(Duration interval, Duration execution = Duration::zero(), int priority = 0) {
    Waiting& waiting = tasks.emplace_back();
    TaskConfig config;
    config.name = "task";
    config.interval = interval;
    config.iec_priority = priority;
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
    const std::size_t released = sut.on_tick(origin + milliseconds(n)).released;
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
  EXPECT_EQ(sut.on_tick(origin - milliseconds(1)).released, 0U);
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

// The tasks due at a tick, found in the plainest way: all tasks are looked at.
TEST_F(TickTableTest, ReleasesWhatANaiveTableOfRandomTasksReleases) {
  constexpr int kTasks = 60;
  std::mt19937 random(7);
  const auto pick = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
  struct Model {
    TimePoint release;
    TimePoint ready;
    Duration interval;
    Duration execution;
    std::vector<TimePoint> expected;
  };
  std::vector<Model> models;
  for (int i = 0; i < kTasks; ++i) {
    const Duration interval = microseconds(100 * pick(5, 200));
    const Duration execution = pick(0, 3) == 0 ? microseconds(100 * pick(1, 60)) : Duration::zero();
    add(interval, execution, pick(0, 31));
    models.push_back(
        {.release = origin, .ready = origin, .interval = interval, .execution = execution, .expected = {}});
  }
  for (int n = 0; n < 300; ++n) {
    const TimePoint now = origin + milliseconds(n);
    tick(n);
    for (int i = 0; i < kTasks; ++i) {
      Model& model = models[static_cast<std::size_t>(i)];
      const Waiting& task = tasks[static_cast<std::size_t>(i)];
      while (model.ready <= now && model.release <= now) {
        model.expected.push_back(model.release);
        model.ready = now + model.execution;
        model.release += model.interval;
        while (model.release < model.ready) model.release += model.interval;
      }
      ASSERT_EQ(task.ran.size(), model.expected.size()) << "task " << i << " at tick " << n;
      if (!task.ran.empty()) {
        ASSERT_EQ(task.ran.back().release, model.expected.back());
      }
    }
  }
}

TEST_F(TickTableTest, TickCostsWhatIsDueHoweverManyTasksThereAre) {
  constexpr int kTasks = 300;
  for (int i = 0; i < kTasks; ++i) add(std::chrono::seconds(1));
  add(milliseconds(1));
  tick(0);
  tick(1);  // all of them came back and are queued
  for (int n = 2; n < 50; ++n) {
    clock.run_until(origin + milliseconds(n));
    const TickTable::Work work = sut.on_tick(origin + milliseconds(n));
    clock.settle();
    EXPECT_EQ(work.released, 1U);
    EXPECT_LE(work.looked_at, 2U);
  }
}

TEST_F(TickTableTest, TaskThatBlocksInItsCycleHoldsUpNobodyBehindIt) {
  Waiting& first = add(milliseconds(10), std::chrono::seconds(5), 0);
  Waiting& second = add(milliseconds(10), Duration::zero(), 1);
  Waiting& third = add(milliseconds(10), Duration::zero(), 2);
  sut.start(origin - milliseconds(1));
  EXPECT_EQ(tick(0), 3U);
  EXPECT_EQ(first.ran.size(), 1U);
  EXPECT_EQ(second.ran.size(), 1U);
  EXPECT_EQ(third.ran.size(), 1U);
  EXPECT_EQ(tick(10), 2U);
  EXPECT_EQ(third.ran.size(), 2U);
}

TEST_F(TickTableTest, TaskThatWasInterruptedIsReleasedForWhatItStatesNext) {
  Waiting& task = add(milliseconds(5));
  Waiting& other = add(milliseconds(3));
  tick(0);
  for (int n = 1; n <= 30; ++n) {
    task.source->interrupt();
    clock.settle();
    tick(n);
  }
  EXPECT_EQ(task.ran.size(), 7U);
  EXPECT_EQ(other.ran.size(), 11U);
}

// Threads and futexes of the system, and a time that stands still between two ticks.
class TickedClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const noexcept override { return TimePoint(Duration(now_.load())); }
  void set(TimePoint now) { now_.store(now.time_since_epoch().count()); }
  void wait(const std::atomic<std::uint32_t>& word, std::uint32_t expected, TimePoint) noexcept override {
    system_.wait(word, expected, kNoDeadline);
  }
  void wait(CountedEvent& event, CountedEvent::Snapshot seen) noexcept override { system_.wait(event, seen); }
  void wake(const std::atomic<std::uint32_t>& word) noexcept override { system_.wake(word); }
  void spin_until(TimePoint) noexcept override {}
  [[nodiscard]] Result<std::unique_ptr<PeriodicTimer>> make_periodic_timer() override {
    return system_.make_periodic_timer();
  }

 private:
  LinuxClock system_;
  std::atomic<Duration::rep> now_{0};
};

// As fast as they can: each tick either sees a task that comes back or is seen by it. One that is missed
// would never run again. Interrupts come in between, and an order that a task leaves is passed on all the
// same.
TEST(TickTableUnderRace, MissesNoTaskThatComesBackWhileItTicks) {
  constexpr std::uint64_t kCycles = 5000;
  constexpr std::size_t kTasks = 5;
  TickedClock clock;
  TickTable sut(clock);
  TimePoint tick{std::chrono::seconds(1)};
  clock.set(tick);
  std::deque<TaskStatistics> statistics(kTasks);
  std::vector<std::unique_ptr<Task>> tasks;
  std::vector<std::unique_ptr<ActivationSource>> sources;
  for (std::size_t i = 0; i < kTasks; ++i) {
    TaskConfig config;
    config.name = "task";
    config.interval = Duration(1 + i % 3);
    config.iec_priority = static_cast<int>(i);
    config.entry = [] {};
    tasks.push_back(std::make_unique<Task>(clock, config, statistics[i], nullptr));
    tasks.back()->begin(tick);
    sources.push_back(sut.add(*tasks.back(), FreewheelRule({})));
  }
  sut.start(tick - Duration(1));
  std::atomic<std::size_t> done{0};
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < kTasks; ++i) {
    threads.emplace_back([&, i] {
      for (std::uint64_t cycles = 0; cycles < kCycles;) {
        const auto activation = sources[i]->wait();
        if (!activation) continue;
        EXPECT_LE(activation->release, clock.now());
        tasks[i]->run_cycle(*activation);
        ++cycles;
      }
      ++done;
    });
  }
  for (std::size_t n = 0; done < kTasks; ++n, tick += Duration(1)) {
    clock.set(tick);
    sut.on_tick(tick);
    if (n % 7 == 0) sources[n % kTasks]->interrupt();
    if (n % 3 == 0) std::this_thread::yield();
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace plchost
