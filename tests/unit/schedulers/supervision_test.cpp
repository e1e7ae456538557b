#include "schedulers/faults/supervision.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <latch>
#include <map>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/support/manual_clock.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

// What a watchdog strikes with is blocked in this thread, as an application's code could block it: so nothing
// but the record tells of the strike, and the test goes on.
class SupervisionTest : public testing::Test {
 protected:
  SupervisionTest() {
    ::sigemptyset(&strike_);
    ::sigaddset(&strike_, SIGRTMAX - 1);
    ::pthread_sigmask(SIG_BLOCK, &strike_, &before_);
    TaskConfig config;
    config.name = "main";
    config.interval = milliseconds(10);
    config.watchdog.omitted_cycles = 3;
    config.entry = [] {};
    tasks_.push_back(std::make_unique<Task>(clock_, std::move(config), statistics_, nullptr, &board_));
    task_ = tasks_.back().get();
    settings_.watchdog.default_time = milliseconds(40);
    settings_.watchdog.omitted_cycles = true;
    sut_.emplace(clock_, tasks_, poller_);
  }
  ~SupervisionTest() override {
    const timespec at_once{};
    while (::sigtimedwait(&strike_, nullptr, &at_once) > 0) continue;
    ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }

  void begin() {
    task_->begin(clock_.now());
    sut_->begin(settings_, 1);
  }
  TimePoint look() { return sut_->look(clock_.now()); }
  [[nodiscard]] bool is_struck() const {
    sigset_t pending;
    ::sigpending(&pending);
    return ::sigismember(&pending, SIGRTMAX - 1) == 1;
  }

  sigset_t strike_{};
  sigset_t before_{};
  ManualClock clock_;
  TaskStatistics statistics_{};
  FaultBoard board_;
  std::vector<std::unique_ptr<Task>> tasks_;
  Task* task_ = nullptr;
  FaultTrap poller_;
  SchedulerSettings settings_;
  std::optional<Supervision> sut_;
};

TEST_F(SupervisionTest, StrikesACycleOnceItIsLongerThanItsLimitAndNotBefore) {
  begin();
  const TimePoint start = clock_.now();
  task_->trap().arm(task_->fault(), start);
  clock_.run_until(start + milliseconds(40));
  EXPECT_EQ(look(), start + milliseconds(40) + Duration(1)) << "a cycle may last as long as its limit";
  EXPECT_FALSE(is_struck());
  clock_.run_until(start + milliseconds(40) + Duration(1));
  EXPECT_EQ(look(), clock_.now() + Supervision::kPatience);
  EXPECT_TRUE(is_struck());
  EXPECT_FALSE(task_->fault().raised()) << "the thread that was struck raises it";
  task_->trap().disarm();
}

TEST_F(SupervisionTest, RaisesTheFaultItselfOfACycleThatNoStrikeReaches) {
  begin();
  const TimePoint start = clock_.now();
  task_->trap().arm(task_->fault(), start);
  clock_.run_until(start + milliseconds(50));
  const TimePoint again = look();
  clock_.run_until(again - Duration(1));
  EXPECT_EQ(look(), again);
  EXPECT_EQ(task_->fault().published(), nullptr);
  clock_.run_until(again);
  (void)look();
  const FaultRecord* const record = task_->fault().published();
  ASSERT_NE(record, nullptr);
  EXPECT_EQ(record->kind, FaultKind::task_watchdog);
  EXPECT_EQ(Duration(record->figure), milliseconds(50));
  EXPECT_EQ(Duration(record->limit), milliseconds(40));
  EXPECT_THAT(describe_fault(*record), testing::HasSubstr("could not be caught and runs on"));
  EXPECT_TRUE(board_.halted()) << "the whole application stops";
  task_->trap().disarm();
}

TEST_F(SupervisionTest, LooksAgainWhenACycleThatBeganAtTheNextReleaseWouldBeTooLong) {
  settings_.watchdog.omitted_cycles = false;
  begin();
  const auto due = task_->due();
  ASSERT_TRUE(due);
  EXPECT_EQ(look(), *due + milliseconds(40));
  sut_->end();
}

TEST_F(SupervisionTest, CountsNoOmittedCycleInTheGraceAfterTheStart) {
  begin();
  const TimePoint start = clock_.now();
  clock_.run_until(start + Supervision::kGrace + milliseconds(30) - Duration(1));
  (void)look();
  EXPECT_FALSE(task_->fault().raised());
  clock_.run_until(start + Supervision::kGrace + milliseconds(30));
  (void)look();
  const FaultRecord* const record = task_->fault().published();
  ASSERT_NE(record, nullptr);
  EXPECT_EQ(record->kind, FaultKind::omitted_cycles);
  EXPECT_EQ(record->limit, 3);
  EXPECT_GE(record->figure, record->limit);
}

TEST_F(SupervisionTest, NeverMissesReleasesThatLieBehindTheEndOfTheClock) {
  TaskConfig config = task_->config();
  config.interval = std::chrono::hours(24 * 49);
  config.watchdog.omitted_cycles = 3000;
  sut_.reset();
  tasks_[0] = std::make_unique<Task>(clock_, std::move(config), statistics_, nullptr, &board_);
  task_ = tasks_[0].get();
  sut_.emplace(clock_, tasks_, poller_);
  settings_.watchdog.default_time = {};
  begin();
  clock_.run_for(Supervision::kGrace * 10);
  EXPECT_EQ(look(), kNoDeadline);
  EXPECT_FALSE(task_->fault().raised());
}

TEST_F(SupervisionTest, CountsNoOmittedCycleWhileTheTasksStop) {
  begin();
  sut_->tasks_stop();
  clock_.run_for(Supervision::kGrace * 10);
  (void)look();
  EXPECT_FALSE(task_->fault().raised());
}

// The guard against endless loops: its limit is 40 ms.
class LeniencyTest : public SupervisionTest {
 protected:
  /// A cycle that began now; looked at, as soon as it is.
  void begin_cycle() {
    begin();
    start_ = clock_.now();
    task_->trap().arm(task_->fault(), start_);
    planned_ = look();
    ASSERT_EQ(planned_, start_ + milliseconds(40)) << "for an event variable, too";
  }
  TimePoint look_at(TimePoint time) {
    clock_.run_until(time);
    return look();
  }
  void TearDown() override { task_->trap().disarm(); }

  TimePoint start_;
  TimePoint planned_;
};

TEST_F(LeniencyTest, LetsACycleOffForATimeInWhichEverythingStoodStill) {
  begin_cycle();
  const TimePoint end_of_standstill = planned_ + Supervision::kStandstill + Duration(1);
  EXPECT_EQ(look_at(end_of_standstill), end_of_standstill + milliseconds(40));
  EXPECT_FALSE(is_struck());
  const TimePoint last_allowed = end_of_standstill + milliseconds(40);
  EXPECT_EQ(look_at(last_allowed), last_allowed + Duration(1));
  EXPECT_FALSE(is_struck()) << "it has its whole time once more";
  (void)look_at(last_allowed + Duration(1));
  EXPECT_TRUE(is_struck()) << "but not more than that";
}

TEST_F(LeniencyTest, TakesNoOrdinaryDelayForAStandstill) {
  begin_cycle();
  (void)look_at(planned_ + Supervision::kStandstill);
  EXPECT_TRUE(is_struck());
}

TEST_F(LeniencyTest, HoldsForNoTaskWithAWatchdogOfItsOwn) {
  TaskConfig config = task_->config();
  config.watchdog.time = milliseconds(40);
  sut_.reset();
  tasks_[0] = std::make_unique<Task>(clock_, std::move(config), statistics_, nullptr, &board_);
  task_ = tasks_[0].get();
  sut_.emplace(clock_, tasks_, poller_);
  begin_cycle();
  (void)look_at(planned_ + Supervision::kStandstill + Duration(1));
  EXPECT_TRUE(is_struck());
}

TEST_F(LeniencyTest, IsItsThreadsWhenItWakesLate) {
  ASSERT_TRUE(sut_->start_thread({}));
  clock_.settle();
  begin();
  clock_.settle();
  const TimePoint start = clock_.now();
  task_->trap().arm(task_->fault(), start);
  constexpr Duration kLate = Supervision::kStandstill + milliseconds(1);
  clock_.set_wake_latency(kLate);
  clock_.run_until(start + milliseconds(40) + kLate);  // it had planned to wake at 40 ms
  clock_.set_wake_latency(Duration::zero());
  clock_.run_until(start + kLate + milliseconds(80));
  EXPECT_FALSE(is_struck());
  clock_.run_until(start + kLate + milliseconds(80) + Duration(1));
  EXPECT_TRUE(is_struck());
}

/// What a test says that the threads have used.
class FakeTimes final : public ProcessorTimes {
 public:
  [[nodiscard]] Duration of_process() const noexcept override { return process; }
  [[nodiscard]] Duration of_thread(pid_t thread) const noexcept override {
    const auto found = threads.find(thread);
    return found == threads.end() ? Duration::zero() : found->second;
  }
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
    EXPECT_TRUE(board_.halted()) << "whatever the policy of the task that used the most";
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

TEST_F(LoadWatchdogTest, IsOffUnlessItIsEnabledAndHasAMaximum) {
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
