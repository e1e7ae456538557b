#include <algorithm>
#include <array>
#include <latch>
#include <map>
#include <optional>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "schedulers/supervision/supervision.hpp"
#include "tests/support/manual_clock.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

/// A test's claim of the threads' processor time.
class FakeTimes final : public ProcessorTimes {
 public:
  [[nodiscard]] Duration of_process() const noexcept override { return process; }
  [[nodiscard]] Duration of_thread(pid_t thread) const noexcept override {
    const auto found = threads.find(thread);
    return found == threads.end() ? Duration::zero() : found->second;
  }
  [[nodiscard]] Duration ready_time_of_thread(pid_t) const noexcept override { return {}; }
  [[nodiscard]] bool sleeps(pid_t) const noexcept override { return false; }
  [[nodiscard]] std::size_t real_time_threads(std::span<pid_t>) const noexcept override { return 0; }
  [[nodiscard]] ThreadText demote(pid_t) const noexcept override { return {}; }
  Duration process = std::chrono::seconds(7);  // since its start: only differences count
  std::map<pid_t, Duration> threads;
};

// The load watchdog, as it is told of time and of processor time: at most 60 percent in a second. The third
// task is freewheeling.
class LoadWatchdogTest : public testing::Test {
 protected:
  static constexpr std::size_t kTasks = 3;
  static constexpr Duration kWindow = std::chrono::seconds(1);

  void SetUp() override {
    for (std::size_t i = 0; i < kTasks; ++i) {
      TaskConfig config;
      config.name = "task" + std::to_string(i);
      config.kind = i + 1 == kTasks ? TaskKind::freewheeling : TaskKind::cyclic;
      config.interval = milliseconds(10);
      config.watchdog.policy = WatchdogPolicy::task;
      config.entry = [] {};
      tasks_.push_back(std::make_unique<Task>(clock_, std::move(config), statistics_[i], nullptr, &board_));
    }
    give_each_a_thread();
    settings_.watchdog = {
        .load = true, .load_interval = kWindow, .omitted_cycles = false, .default_time = {}};
    settings_.processor_load_maximum = 60;
    sut_.emplace(clock_, tasks_, poller_, times_);
  }
  // All at the same time, so that no number is given twice.
  void give_each_a_thread() {
    std::latch all_here(kTasks);
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < kTasks; ++i) {
      threads.emplace_back([&, i] {
        tasks_[i]->trap().arm(tasks_[i]->fault(), clock_.now());
        tasks_[i]->trap().disarm();
        all_here.arrive_and_wait();
      });
    }
    threads.clear();
    for (const auto& task : tasks_) times_.threads[task->trap().thread()] = std::chrono::seconds(1);
    ASSERT_EQ(times_.threads.size(), kTasks);
  }
  /// Begins, and lets the grace pass: a window begins.
  void begin_window(int cores = 1) {
    sut_->begin(settings_, cores);
    clock_.run_for(Supervision::kGrace);
    ASSERT_EQ(look(), clock_.now() + kWindow);
  }
  /// The process has used so much in all, and of that these tasks so much.
  void use(Duration process, std::vector<Duration> tasks = {}) {
    times_.process += process;
    for (std::size_t i = 0; i < tasks.size(); ++i) times_.threads[tasks_[i]->trap().thread()] += tasks[i];
  }
  TimePoint look() { return sut_->look(clock_.now()); }
  [[nodiscard]] bool any_raised() const {
    return std::ranges::any_of(tasks_, [](const auto& task) { return task->fault().raised(); });
  }
  void expect_hit(std::size_t task, int percent) {
    for (std::size_t i = 0; i < kTasks; ++i) EXPECT_EQ(tasks_[i]->fault().raised(), i == task) << i;
    const FaultRecord* const record = tasks_[task]->fault().published();
    ASSERT_NE(record, nullptr);
    EXPECT_EQ(record->kind, FaultKind::processor_load);
    EXPECT_EQ(record->figure, percent);
    EXPECT_EQ(record->limit, 60);
    EXPECT_TRUE(board_.halted()) << "under any policy of the task that used the most";
  }

  ManualClock clock_;
  std::array<TaskStatistics, kTasks> statistics_;
  FaultBoard board_;
  std::vector<std::unique_ptr<Task>> tasks_;
  FaultTrap poller_;
  FakeTimes times_;
  SchedulerSettings settings_;
  std::optional<Supervision> sut_;
};

TEST_F(LoadWatchdogTest, AllowsTheMaximumAndHitsAboveItInTheNextWindow) {
  begin_window();
  use(milliseconds(600), {milliseconds(300), milliseconds(290)});
  clock_.run_for(kWindow);
  EXPECT_EQ(look(), clock_.now() + kWindow);
  EXPECT_FALSE(any_raised());
  use(milliseconds(610), {milliseconds(290), milliseconds(300)});
  clock_.run_for(kWindow);
  EXPECT_EQ(look(), clock_.now() + kWindow);
  expect_hit(1, 61);
}

TEST_F(LoadWatchdogTest, LooksAtTheEndOfAWindowAndNotBefore) {
  begin_window();
  const TimePoint end = clock_.now() + kWindow;
  use(milliseconds(990), {milliseconds(900)});
  clock_.run_until(end - Duration(1));
  EXPECT_EQ(look(), end);
  EXPECT_FALSE(any_raised());
  clock_.run_until(end);
  (void)look();
  expect_hit(0, 99);
}

TEST_F(LoadWatchdogTest, MeasuresNothingInTheGraceAfterTheStart) {
  sut_->begin(settings_, 1);
  const TimePoint start = clock_.now();
  EXPECT_EQ(look(), start + Supervision::kGrace);
  use(Supervision::kGrace, {Supervision::kGrace});  // all that there was
  clock_.run_for(Supervision::kGrace);
  EXPECT_EQ(look(), clock_.now() + kWindow);
  use(milliseconds(600), {milliseconds(600)});
  clock_.run_for(kWindow);
  (void)look();
  EXPECT_FALSE(any_raised());
}

TEST_F(LoadWatchdogTest, BeginsAnewWithAnExchangeOfTheScheduler) {
  begin_window();
  use(milliseconds(900), {milliseconds(900)});
  clock_.run_for(milliseconds(900));
  begin_window();  // with a grace of its own
  use(milliseconds(600), {milliseconds(600)});
  clock_.run_for(kWindow);
  (void)look();
  EXPECT_FALSE(any_raised());
  use(milliseconds(610), {milliseconds(610)});
  clock_.run_for(kWindow);
  (void)look();
  expect_hit(0, 61);
}

TEST_F(LoadWatchdogTest, MeasuresNothingWhileTheTasksStopOrAreStopped) {
  for (const bool stopped : {false, true}) {
    begin_window();
    sut_->tasks_stop();
    if (stopped) sut_->end();
    use(kWindow * 3, {kWindow * 3});
    clock_.run_for(kWindow * 3);
    EXPECT_EQ(look(), kNoDeadline);
    EXPECT_FALSE(any_raised());
  }
  begin_window();
  use(milliseconds(610), {milliseconds(610)});
  clock_.run_for(kWindow);
  (void)look();
  expect_hit(0, 61);
}

TEST_F(LoadWatchdogTest, MeasuresAWindowThatItEndsLateOverItsRealLength) {
  begin_window();
  use(milliseconds(1'200), {milliseconds(1'200)});
  clock_.run_for(kWindow * 2);
  EXPECT_EQ(look(), clock_.now() + kWindow);
  EXPECT_FALSE(any_raised()) << "1.2 s of 2 s";
  use(milliseconds(1'220), {milliseconds(1'220)});
  clock_.run_for(kWindow * 2);
  (void)look();
  expect_hit(0, 61);
}

TEST_F(LoadWatchdogTest, LeavesOutWhatFreewheelingTasksUse) {
  begin_window();
  use(milliseconds(990), {milliseconds(500), milliseconds(0), milliseconds(390)});
  clock_.run_for(kWindow);
  (void)look();
  EXPECT_FALSE(any_raised()) << "60 % without it";
  use(milliseconds(990), {milliseconds(10), milliseconds(5), milliseconds(380)});
  clock_.run_for(kWindow);
  (void)look();
  expect_hit(0, 61);  // not the freewheeling one, though it used the most
}

TEST_F(LoadWatchdogTest, CountsWhatOtherThreadsOfTheInstanceUse) {
  begin_window();
  use(milliseconds(610), {milliseconds(1), milliseconds(2)});
  clock_.run_for(kWindow);
  (void)look();
  expect_hit(1, 61);
}

TEST_F(LoadWatchdogTest, OnSeveralCoresLooksAtTheirAverageAndAtTheBusiestThread) {
  begin_window(4);
  use(milliseconds(2'400), {milliseconds(600), milliseconds(600)});
  clock_.run_for(kWindow);
  (void)look();
  EXPECT_FALSE(any_raised());
  use(milliseconds(700), {milliseconds(20), milliseconds(610)});
  clock_.run_for(kWindow);
  (void)look();
  expect_hit(1, 61);
}

TEST_F(LoadWatchdogTest, HitsAtTheAverageOfSeveralCores) {
  begin_window(4);
  use(milliseconds(2'440), {milliseconds(600), milliseconds(590)});
  clock_.run_for(kWindow);
  (void)look();
  expect_hit(0, 61);
}

TEST_F(LoadWatchdogTest, IsOffUnlessItIsEnabledAndHasAMaximumOrTheGuardATime) {
  for (const bool enabled : {false, true}) {
    settings_.watchdog.load = enabled;
    settings_.processor_load_maximum = enabled ? 0 : 60;
    sut_->begin(settings_, 1);
    EXPECT_EQ(look(), kNoDeadline);
    use(kWindow * 2, {kWindow * 2});
    clock_.run_for(kWindow * 2);
    EXPECT_EQ(look(), kNoDeadline);
    EXPECT_FALSE(any_raised());
  }
}

TEST_F(LoadWatchdogTest, IsWokenByItsThreadAtTheEndOfEachWindow) {
  ASSERT_TRUE(sut_->start_thread({}));
  clock_.settle();
  sut_->begin(settings_, 1);
  clock_.run_for(Supervision::kGrace);
  for (int window = 0; window < 3; ++window) {
    use(milliseconds(600), {milliseconds(600)});
    clock_.run_for(kWindow);
    EXPECT_FALSE(any_raised());
  }
  use(milliseconds(610), {milliseconds(610)});
  clock_.run_for(kWindow - Duration(1));
  EXPECT_FALSE(any_raised());
  clock_.run_for(Duration(1));
  expect_hit(0, 61);
}

// Nothing is set but the defaults: the guard against overload, over two windows of two seconds.
class OverloadTest : public LoadWatchdogTest {
 protected:
  static constexpr Duration kGuard = std::chrono::seconds(2);

  void SetUp() override {
    LoadWatchdogTest::SetUp();
    settings_.watchdog = {};
    settings_.processor_load_maximum = 0;
  }
  // For ever as long as a cycle may take, or the guard against endless loops would hit in the test's cycles.
  void begin() {
    sut_->begin(settings_, 1);
    clock_.run_for(Supervision::kGrace);
    (void)look();
  }
  /// A window in which the first task ran, each time with so many releases lost before.
  void pass(std::uint64_t lost, Duration used) {
    for (int i = 0; i < 3; ++i) {
      tasks_[0]->run_cycle({.release = clock_.now(), .lost_cycles = lost});
    }
    use(used, {used});
    clock_.run_for(kGuard);
    (void)look();
  }
};

TEST_F(OverloadTest, EndsATaskThatLosesReleasesBeforeEachCycleAndLeavesNothingOfTheCore) {
  begin();
  pass(1, kGuard);
  EXPECT_FALSE(any_raised()) << "only suspected";
  pass(1, kGuard * 91 / 100);
  ASSERT_TRUE(tasks_[0]->fault().raised());
  const FaultRecord* const record = tasks_[0]->fault().published();
  ASSERT_NE(record, nullptr);
  EXPECT_EQ(record->kind, FaultKind::processor_load);
  EXPECT_EQ(record->figure, 91);
  EXPECT_EQ(record->limit, kOverloadPercent);
  EXPECT_TRUE(board_.halted());
}

TEST_F(OverloadTest, LeavesAloneWhoUsesTheWholeCoreAndLosesNothing) {
  begin();
  for (int window = 0; window < 4; ++window) pass(0, kGuard);
  EXPECT_FALSE(any_raised());
}

TEST_F(OverloadTest, LeavesAloneWhoLosesReleasesAndLeavesSomeOfTheCore) {
  begin();
  for (int window = 0; window < 4; ++window) pass(1, kGuard * kOverloadPercent / 100);
  EXPECT_FALSE(any_raised());
}

TEST_F(OverloadTest, ForgivesABurst) {
  begin();
  for (int window = 0; window < 4; ++window) {
    pass(1, kGuard);
    pass(0, kGuard);
  }
  EXPECT_FALSE(any_raised());
}

TEST_F(OverloadTest, BeginsAnewWithAnExchangeOfTheScheduler) {
  begin();
  pass(1, kGuard);
  begin();
  pass(1, kGuard);
  EXPECT_FALSE(any_raised());
  pass(1, kGuard);
  EXPECT_TRUE(any_raised());
}

TEST_F(OverloadTest, IsNotGuardedAgainstWhereTheWatchdogIsOff) {
  settings_.watchdog.load = false;
  begin();
  for (int window = 0; window < 4; ++window) pass(1, kGuard);
  EXPECT_FALSE(any_raised());
}

TEST(LinuxProcessorTimes, CountWhatThisThreadUsesForItAndForItsProcess) {
  const ProcessorTimes& sut = linux_processor_times();
  const Duration process = sut.of_process();
  const Duration thread = sut.of_thread(::gettid());
  EXPECT_GT(thread, Duration::zero());
  while (sut.of_thread(::gettid()) < thread + milliseconds(5)) continue;
  EXPECT_GE(sut.of_process(), process + milliseconds(5));
  EXPECT_EQ(sut.of_thread(1), Duration::zero()) << "of another process";
}

}  // namespace
}  // namespace plchost
