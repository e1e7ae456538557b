#include "schedulers/supervision/supervision.hpp"

#include <algorithm>
#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/manual_clock.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

/// A test's claim of the processor time of its only thread.
class FakeUse final : public ProcessorTimes {
 public:
  [[nodiscard]] Duration of_process() const noexcept override { return used; }
  [[nodiscard]] Duration of_thread(pid_t) const noexcept override { return used; }
  [[nodiscard]] Duration ready_time_of_thread(pid_t) const noexcept override { return {}; }
  [[nodiscard]] bool sleeps(pid_t) const noexcept override { return asleep; }
  [[nodiscard]] std::size_t real_time_threads(std::span<pid_t>) const noexcept override { return 0; }
  [[nodiscard]] ThreadText demote(pid_t) const noexcept override { return {}; }
  Duration used = std::chrono::seconds(7);  // since it was made
  bool asleep = false;
};

// The watchdog's signal is blocked in this thread, as an application's code could block it. So nothing but
// the record tells of the strike, and the test goes on.
class SupervisionTest : public testing::Test {
 protected:
  SupervisionTest() {
    ::sigemptyset(&strike_);
    ::sigaddset(&strike_, SIGRTMAX - 1);
    ::pthread_sigmask(SIG_BLOCK, &strike_, &before_);
    TaskConfig config;
    config.name = "main";
    config.interval = milliseconds(10);
    config.watchdog.time = milliseconds(40);
    config.watchdog.omitted_cycles = 3;
    config.entry = [] {};
    tasks_.resize(1);
    settings_.watchdog.default_time = {};  // event variables are not looked at
    settings_.watchdog.omitted_cycles = true;
    make(std::move(config));
  }
  void make(TaskConfig config) {
    sut_.reset();
    tasks_[0] = std::make_unique<Task>(clock_, std::move(config), statistics_, nullptr, &board_);
    task_ = tasks_[0].get();
    sut_.emplace(clock_, tasks_, poller_, times_);
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
  FakeUse times_;
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

// The runtime copies retain variables at the end of a cycle.
TEST_F(SupervisionTest, CountsNoReleaseWhileTheTaskWorksForTheRuntime) {
  TaskConfig config = task_->config();
  std::optional<FaultKind> hit;
  bool was_under_watchdog = true;
  config.watchdog.time = milliseconds(1);
  config.between_cycles = [&] {
    was_under_watchdog = task_->trap().running_since().has_value();
    clock_.run_for(milliseconds(500));
    (void)look();
    if (const FaultRecord* const record = task_->fault().published()) hit = record->kind;
    return true;
  };
  make(std::move(config));
  begin();
  clock_.run_for(Supervision::kGrace);
  task_->run_cycle({.release = clock_.now()});
  EXPECT_FALSE(was_under_watchdog);
  EXPECT_FALSE(hit) << to_string(*hit);
  EXPECT_FALSE(task_->fault().raised()) << "it is in no cycle";
  const TimePoint free = clock_.now();
  clock_.run_until(free + 3 * milliseconds(10) - Duration(1));
  (void)look();
  EXPECT_FALSE(task_->fault().raised());
  clock_.run_for(Duration(1));
  (void)look();
  EXPECT_TRUE(task_->fault().raised()) << "from then on it counts";
  EXPECT_GT(task_->next_release(FreewheelRule(settings_)).lost_cycles, 40U)
      << "releases that fell due are lost";
}

TEST_F(SupervisionTest, NeverMissesReleasesThatLieBehindTheEndOfTheClock) {
  TaskConfig config = task_->config();
  config.interval = std::chrono::hours(24 * 49);
  config.watchdog = {.omitted_cycles = 3000};
  make(std::move(config));
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
class EndlessLoopGuard : public SupervisionTest {
 protected:
  static constexpr Duration kLimit = milliseconds(40);
  static constexpr Duration kStep = kLimit / Supervision::kLooks;

  EndlessLoopGuard() {
    TaskConfig config = task_->config();
    config.watchdog = {};
    make(std::move(config));
    settings_.watchdog.default_time = kLimit;
  }
  void TearDown() override { task_->trap().disarm(); }

  /// A cycle that began now; looked at for the first time, as soon as it is.
  void begin_cycle() {
    begin();
    start_ = clock_.now();
    task_->trap().arm(task_->fault(), start_);
    next_ = look();
    ASSERT_LE(next_, start_ + kStep) << "for an event variable, too";
  }
  /// Goes on for `duration`, for `percent` of which the thread has the processor, and looks when it is to.
  void go_on_for(Duration duration, int percent) {
    const TimePoint end = clock_.now() + duration;
    while (clock_.now() < end && !is_struck()) {
      const TimePoint until = std::min(next_, end);
      times_.used += (until - clock_.now()) * percent / 100;
      clock_.run_until(until);
      if (until == next_) next_ = look();
    }
  }
  /// So long nothing goes on, the supervision neither.
  void stand_still(Duration duration) {
    clock_.run_for(duration);
    if (clock_.now() >= next_) next_ = look();
  }

  TimePoint start_;
  TimePoint next_;
};

TEST_F(EndlessLoopGuard, StrikesALoopThatUsesTheProcessorForItsTime) {
  begin_cycle();
  go_on_for(kLimit, 100);
  EXPECT_FALSE(is_struck());
  go_on_for(kStep, 100);
  EXPECT_TRUE(is_struck());
}

TEST_F(EndlessLoopGuard, CountsNoStandstillWhateverItsLength) {
  for (const int tenths : {5, 10, 19, 20, 30, 100}) {
    for (int before = 0; before < 10; ++before) {
      begin_cycle();
      go_on_for(kLimit * before / 10, 100);
      stand_still(kLimit * tenths / 10);
      go_on_for(kLimit * (9 - before) / 10, 100);
      ASSERT_FALSE(is_struck()) << "a standstill of " << tenths << " tenths of the limit, " << before;
      task_->trap().disarm();
      clock_.run_for(milliseconds(1));
    }
  }
}

TEST_F(EndlessLoopGuard, CountsOnlyWhatTheThreadUsesWhileOthersHaveTheProcessor) {
  begin_cycle();
  go_on_for(kLimit * 9, 10);
  EXPECT_FALSE(is_struck());
  go_on_for(kLimit * 3, 10);
  EXPECT_TRUE(is_struck());
}

TEST_F(EndlessLoopGuard, StrikesACycleThatWaitsForItsTimeButCountsNoStandstill) {
  times_.asleep = true;
  begin_cycle();
  go_on_for(kLimit / 2, 0);
  stand_still(kLimit * 5);
  go_on_for(kLimit / 4, 0);
  EXPECT_FALSE(is_struck());
  go_on_for(kLimit / 2, 0);
  EXPECT_TRUE(is_struck());
}

TEST_F(EndlessLoopGuard, BeginsToCountAnewWithEachCycle) {
  for (int cycle = 0; cycle < 5; ++cycle) {
    begin_cycle();
    go_on_for(kLimit, 90);
    ASSERT_FALSE(is_struck()) << cycle;
    task_->trap().disarm();
    clock_.run_for(milliseconds(1));
  }
}

// The thread that reads the variable is the one that ticks.
TEST_F(EndlessLoopGuard, StopsAllTasksForAnEventVariableThatNoStrikeReachesWhateverThePolicyOfItsTask) {
  TaskConfig config = task_->config();
  config.watchdog.policy = WatchdogPolicy::task;
  make(std::move(config));
  begin();
  poller_.arm(task_->fault(), clock_.now(), true);
  next_ = look();
  go_on_for(kLimit * 2, 100);
  ASSERT_TRUE(is_struck());
  clock_.run_for(Supervision::kPatience);
  (void)look();
  poller_.disarm();
  const FaultRecord* const record = task_->fault().published();
  ASSERT_NE(record, nullptr);
  EXPECT_TRUE(record->in_event_variable);
  EXPECT_TRUE(board_.halted());
}

TEST_F(EndlessLoopGuard, HoldsForNoTaskWithAWatchdogOfItsOwn) {
  TaskConfig config = task_->config();
  config.watchdog.time = kLimit;
  make(std::move(config));
  begin();
  task_->trap().arm(task_->fault(), clock_.now());
  clock_.run_for(kLimit + Duration(1));
  (void)look();
  EXPECT_TRUE(is_struck()) << "its time is that of the clock on the wall";
}

}  // namespace
}  // namespace plchost
