#include "schedulers/supervision/starvation.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include "shm/threads/thread.hpp"
#include "tests/support/manual_clock.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

/// A test's claims of its threads. Those with a real-time priority are in `threads`.
class FakeThreads final : public ProcessorTimes {
 public:
  [[nodiscard]] Duration of_process() const noexcept override { return process; }
  [[nodiscard]] Duration of_thread(pid_t thread) const noexcept override {
    const auto found = threads.find(thread);
    return found == threads.end() ? Duration::zero() : found->second;
  }
  [[nodiscard]] Duration ready_time_of_thread(pid_t) const noexcept override { return {}; }
  [[nodiscard]] bool sleeps(pid_t) const noexcept override { return asleep; }
  [[nodiscard]] std::size_t real_time_threads(std::span<pid_t> found) const noexcept override {
    std::size_t count = 0;
    for (const auto& [thread, used] : threads) {
      if (count < found.size() && std::ranges::find(demoted, thread) == demoted.end())
        found[count++] = thread;
    }
    return count;
  }
  [[nodiscard]] ThreadText demote(pid_t thread) const noexcept override {
    demoted.push_back(thread);
    return ThreadText("thread " + std::to_string(thread));
  }
  std::map<pid_t, Duration> threads;
  Duration process = std::chrono::seconds(9);
  bool asleep = false;
  mutable std::vector<pid_t> demoted;
};

// The limit is 200 ms, one task is due every 10 ms.
class StarvationTest : public testing::Test {
 protected:
  static constexpr Duration kGuard = milliseconds(400);
  static constexpr Duration kLimit = milliseconds(200);
  static constexpr Duration kStep = kLimit / Starvation::kLooks;
  static constexpr pid_t kHog = 7;
  static constexpr pid_t kOther = 8;

  StarvationTest() {
    TaskConfig config;
    config.name = "main";
    config.interval = milliseconds(10);
    config.entry = [] {};
    tasks_.push_back(std::make_unique<Task>(clock_, std::move(config), statistics_, nullptr, &board_));
    task_ = tasks_[0].get();
    std::jthread([this] {  // the task has a thread
      task_->trap().arm(task_->fault(), clock_.now());
      task_->trap().disarm();
    })
        .join();
    sut_.emplace(tasks_, poller_, times_);
    sut_->begin(kGuard);
    task_->begin(clock_.now());
  }
  /// Each of `takers` uses `percent` of the time, which is of this process.
  void go_on_for(Duration duration, int percent, const std::vector<pid_t>& takers = {kHog}) {
    const TimePoint end = clock_.now() + duration;
    while (clock_.now() < end) {
      const TimePoint next = sut_->look(clock_.now(), /*running=*/true);
      EXPECT_GT(next, clock_.now());
      const TimePoint before = clock_.now();
      clock_.run_until(std::min(next, end));
      times_.process += (clock_.now() - before) * percent / 100;
      for (const pid_t taker : takers) times_.threads[taker] += (clock_.now() - before) * percent / 100;
    }
    (void)sut_->look(clock_.now(), true);
  }
  [[nodiscard]] const FaultRecord* record() const { return task_->fault().published(); }

  ManualClock clock_;
  TaskStatistics statistics_{};
  FaultBoard board_;
  std::vector<std::unique_ptr<Task>> tasks_;
  Task* task_ = nullptr;
  FaultTrap poller_;
  FakeThreads times_;
  std::optional<Starvation> sut_;
};

TEST_F(StarvationTest, ByAThreadOfTheApplicationIsAFaultAndTakesItsPriority) {
  go_on_for(kLimit, 100);
  EXPECT_EQ(record(), nullptr);
  go_on_for(kStep * 4 + TakerSearch::kLength, 100);
  ASSERT_NE(record(), nullptr);
  EXPECT_EQ(record()->kind, FaultKind::no_processor);
  EXPECT_GE(Duration(record()->figure), kLimit);
  EXPECT_EQ(Duration(record()->limit), kLimit);
  EXPECT_THAT(describe_fault(*record()), HasSubstr("thread 7"));
  EXPECT_TRUE(board_.halted());
  EXPECT_THAT(times_.demoted, testing::ElementsAre(kHog));
  EXPECT_FALSE(sut_->take_starved_by_others());
}

TEST_F(StarvationTest, FindsThoseBelowTheFirstAlsoWhenTheTasksHaveStopped) {
  times_.threads[kOther] = {};
  for (int i = 0; i < 100 && record() == nullptr; ++i) go_on_for(milliseconds(5), 100);
  ASSERT_NE(record(), nullptr);
  EXPECT_TRUE(sut_->searching());
  const TimePoint next = sut_->look(clock_.now(), /*running=*/false);
  times_.threads[kOther] += next - clock_.now();
  clock_.run_until(next + TakerSearch::kLength);
  (void)sut_->look(clock_.now(), false);
  EXPECT_THAT(times_.demoted, testing::Contains(kOther));
  clock_.run_for(TakerSearch::kLength);
  (void)sut_->look(clock_.now(), false);
  EXPECT_FALSE(sut_->searching()) << "nothing takes the processor any more";
}

TEST_F(StarvationTest, ByOtherProgramsIsTold) {
  go_on_for(kLimit * 2, 5);
  EXPECT_EQ(record(), nullptr);
  EXPECT_EQ(sut_->take_starved_by_others(), 0U);
  EXPECT_FALSE(sut_->take_starved_by_others());
  EXPECT_TRUE(times_.demoted.empty());
}

TEST_F(StarvationTest, ByAThreadThatRunsTasksIsForItsOwnWatchdogs) {
  std::jthread([this] {  // as an event variable that does not return
    poller_.arm(task_->fault(), clock_.now());
    poller_.disarm();
  })
      .join();
  go_on_for(kLimit * 3, 100, {poller_.thread()});
  EXPECT_EQ(record(), nullptr);
  EXPECT_FALSE(sut_->take_starved_by_others());
  EXPECT_TRUE(times_.demoted.empty());
}

TEST_F(StarvationTest, IsNoneWhileTheTaskGetsOn) {
  for (int cycle = 0; cycle < 20; ++cycle) {
    go_on_for(kLimit / 2, 100);
    task_->run_cycle({.release = clock_.now()});
  }
  EXPECT_EQ(record(), nullptr);
  EXPECT_FALSE(sut_->searching());
}

TEST_F(StarvationTest, IsNoneWhileTheCycleWaitsForSomethingElse) {
  times_.asleep = true;
  task_->trap().arm(task_->fault(), clock_.now());
  go_on_for(kLimit * 3, 100);
  EXPECT_EQ(record(), nullptr);
  task_->trap().disarm();
}

TEST_F(StarvationTest, OfTheThreadThatReleasesTheTaskIsFoundThoughTheTaskSleeps) {
  times_.asleep = true;
  go_on_for(kLimit * 2, 100);
  EXPECT_NE(record(), nullptr);
}

TEST_F(StarvationTest, IsNoneIfEverythingStandsStill) {
  go_on_for(kLimit / 2, 100);
  clock_.run_for(kLimit * 10);
  times_.process += kLimit * 10;
  (void)sut_->look(clock_.now(), true);
  go_on_for(kLimit / 4, 100);
  EXPECT_EQ(record(), nullptr);
}

TEST_F(StarvationTest, IsNotLookedForWithoutAGuardAgainstEndlessLoops) {
  sut_->begin({});
  EXPECT_EQ(sut_->look(clock_.now(), true), kNoDeadline);
  go_on_for(Duration(1), 100);
  EXPECT_EQ(record(), nullptr);
}

TEST_F(StarvationTest, OfTheWholeRuntimeThatWasReportedIsAFaultOfATask) {
  ProcessorGuard::report(ThreadText("thread 'high' (SCHED_FIFO 99)"), kLimit);
  (void)sut_->look(clock_.now(), true);
  ASSERT_NE(record(), nullptr);
  EXPECT_THAT(describe_fault(*record()), HasSubstr("thread 'high' (SCHED_FIFO 99)"));
  EXPECT_TRUE(sut_->searching()) << "there may be more below it";
  EXPECT_FALSE(ProcessorGuard::take());
}

// The kernel's own: a thread that has the priority, and one that has not.
TEST(RealTimeThreads, AreListedAndLoseTheirPriorityByName) {
  std::atomic<pid_t> id{0};
  std::atomic<bool> end{false};
  const auto body = [&] {
    id = ::gettid();
    while (!end) ::usleep(1000);
  };
  const auto thread = Thread::start("rival", {.fifo = 5}, body);
  if (!thread) GTEST_SKIP() << thread.error().describe();
  while (id == 0) ::usleep(1000);
  const ProcessorTimes& sut = linux_processor_times();
  const auto listed = [&] {
    std::vector<pid_t> found(64);
    found.resize(sut.real_time_threads(found));
    return found;
  };
  EXPECT_THAT(listed(), testing::Contains(id.load()));
  EXPECT_THAT(listed(), testing::Not(testing::Contains(::gettid())));
  EXPECT_EQ(sut.demote(id).view(), "thread 'rival' (SCHED_FIFO 5)");
  EXPECT_EQ(::sched_getscheduler(id) & ~SCHED_RESET_ON_FORK, SCHED_OTHER);
  EXPECT_THAT(listed(), testing::Not(testing::Contains(id.load())));
  EXPECT_EQ(sut.demote(id).view(), "") << "it has none any more";
  end = true;
}

}  // namespace
}  // namespace plchost
