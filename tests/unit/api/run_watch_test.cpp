#include "api/server/status/run_watch.hpp"

#include <map>
#include <string>

#include <gmock/gmock.h>

#include "api/dds/text.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;

class RunWatchTest : public testing::Test {
 protected:
  static constexpr std::int32_t kPid = 77;

  RunWatchTest() {
    write_running(1);
    InstanceStatus instance;
    instance.name.assign("line1");
    instance.pid = kPid;
    (void)tasks_.follow(instance, now_);
  }
  ~RunWatchTest() override { InstancePage::remove(pool_, "line1"); }

  static InstancePage make_page(const std::string& pool) {
    TaskIdentity task;
    task.name.assign("Fill");
    task.external_event.assign("ready");
    task.kind = TaskKind::external;
    return InstancePage::create(pool, "line1", std::array{task}).value();
  }
  void write_running(std::uint32_t running, ApplicationState state = ApplicationState::none) {
    InstanceRuntime runtime;
    runtime.pid = kPid;
    runtime.running = running;
    runtime.state = state;
    page_.write_runtime(runtime);
  }
  /// The task's last cycle: for which post, and how long after now_ it began; it took 3 us.
  void write_cycle(std::uint64_t post, microseconds start, std::uint64_t lost_first = 0,
                   std::uint64_t lost_last = 0) {
    TaskCounters counters{};
    counters.posts_done = post;
    counters.posts_lost_first = lost_first;
    counters.posts_lost_last = lost_last;
    counters.release_ns = (now_ + start - microseconds(2)).time_since_epoch().count();
    counters.latency_last_ns = 2000;
    counters.exec_last_ns = 3000;
    page_.statistics(0).counters.write(counters);
  }
  [[nodiscard]] AwaitedPost post(std::uint64_t sequence, const std::string& event,
                                 std::uint64_t count) const {
    AwaitedPost awaited;
    awaited.source.bytes[0] = 1;
    awaited.sequence = sequence;
    awaited.targets.push_back({"line1", event, count});
    awaited.received = now_;
    return awaited;
  }

  std::string pool_ = own_name("runs");
  TimePoint now_ = MonotonicClock::now();
  InstancePage page_ = make_page(pool_);
  StatusTable<plc_TaskStatus> table_;
  TaskWatch tasks_{pool_, table_, StatisticsWriter("hosta", 7, dds::TopicWriter())};
  RunWatch sut_{"hosta", 7};
};

TEST_F(RunWatchTest, TellsWhenTheTaskHasRunForThePost) {
  sut_.add(post(5, "ready", 3), tasks_);
  write_cycle(2, microseconds(4));
  EXPECT_TRUE(sut_.look(tasks_, now_).empty());
  write_cycle(3, microseconds(10));

  const auto told = sut_.look(tasks_, now_);

  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, 0);
  EXPECT_EQ(told[0].sequence_number, 5U);
  EXPECT_EQ(told[0].epoch, 7U);
  EXPECT_EQ(told[0].tasks, 1U);
  EXPECT_EQ(dds::text_of(told[0].last_task), "line1/Fill");
  EXPECT_EQ(told[0].start_ns, 10'000);
  EXPECT_EQ(told[0].end_ns, 13'000);
  EXPECT_TRUE(sut_.empty());
}

TEST_F(RunWatchTest, TellsThatThePostWasLostThoughALaterOneWasRun) {
  for (const std::uint64_t count : {2U, 3U, 5U, 6U}) sut_.add(post(count, "ready", count), tasks_);
  write_cycle(6, microseconds(10), 3, 5);

  const auto told = sut_.look(tasks_, now_);

  const std::map<std::uint64_t, std::string> expected = {
      {2, "whether it was run is not known"}, {3, "the post was lost"}, {5, "the post was lost"}, {6, ""}};
  ASSERT_EQ(told.size(), expected.size());
  for (const auto& run : told) {
    EXPECT_EQ(run.code, run.sequence_number == 6 ? 0 : static_cast<int>(ErrorCode::wrong_state));
    EXPECT_THAT(std::string(dds::text_of(run.text)), testing::StartsWith(expected.at(run.sequence_number)));
  }
}

TEST_F(RunWatchTest, TellsOfAPostThatCameAgainOnceAndFromItsFirstArrival) {
  sut_.add(post(5, "ready", 3), tasks_);
  AwaitedPost again = post(5, "ready", 3);
  again.received += microseconds(500);
  sut_.add(again, tasks_);
  write_cycle(3, microseconds(10));

  const auto told = sut_.look(tasks_, now_);

  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].end_ns, 13'000);
}

TEST_F(RunWatchTest, TellsAtOnceWhyNoTaskRuns) {
  AwaitedPost rejected = post(5, "ready", 3);
  rejected.targets.clear();
  rejected.unrun = {
      .code = ErrorCode::not_found, .system_errno = 0, .message = "no external event 'line1/other'"};
  sut_.add(rejected, tasks_);

  const auto told = sut_.look(tasks_, now_);

  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, static_cast<int>(ErrorCode::not_found));
  EXPECT_EQ(dds::text_of(told[0].text), "no external event 'line1/other'");
}

TEST_F(RunWatchTest, NamesTheTaskAlsoIfItRanBeforeThePostCameAgain) {
  write_cycle(3, microseconds(10));
  AwaitedPost again = post(5, "ready", 3);
  again.received += microseconds(500);
  sut_.add(again, tasks_);

  const auto told = sut_.look(tasks_, now_);

  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(dds::text_of(told[0].last_task), "line1/Fill");
  EXPECT_EQ(told[0].start_ns, 0);
  EXPECT_EQ(told[0].end_ns, 0);
}

TEST_F(RunWatchTest, KnowsAnEventOfTheSameNameOfAnotherInstanceForAnother) {
  EXPECT_EQ(tasks_.bound_tasks("line1", "ready").size(), 1U);
  EXPECT_TRUE(tasks_.bound_tasks("line2", "ready").empty());
}

TEST_F(RunWatchTest, TellsAtOnceThatNoTaskIsBound) {
  AwaitedPost awaited = post(1, "other", 1);
  awaited.targets.front().taken = false;
  sut_.add(awaited, tasks_);
  const auto told = sut_.look(tasks_, now_);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, static_cast<int>(ErrorCode::not_found));
}

TEST_F(RunWatchTest, WaitsForATaskThatTookThePostAndIsNotSeenYet) {
  InstanceStatus instance;
  instance.name.assign("line1");
  (void)tasks_.forget("line1");
  sut_.add(post(1, "ready", 1), tasks_);
  EXPECT_TRUE(sut_.look(tasks_, now_).empty()) << "a server that has just begun has opened no page yet";
  write_cycle(1, microseconds(10));
  instance.pid = kPid;
  (void)tasks_.follow(instance, now_ + std::chrono::seconds(1));
  const auto told = sut_.look(tasks_, now_);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, 0);
  EXPECT_EQ(told[0].tasks, 1U);
}

TEST_F(RunWatchTest, DoesNotCallATaskStoppedThatIsInItsLastCycle) {
  sut_.add(post(1, "ready", 1), tasks_);
  write_running(0, ApplicationState::stopping);
  EXPECT_TRUE(sut_.look(tasks_, now_).empty());
  write_cycle(1, microseconds(10));
  write_running(0, ApplicationState::stopped);
  const auto told = sut_.look(tasks_, now_);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, 0);
}

TEST_F(RunWatchTest, SaysThatItDoesNotKnowOfAPostThatCameAgainLate) {
  AwaitedPost awaited = post(1, "ready", 5);
  awaited.targets.front().exact = false;
  sut_.add(awaited, tasks_);
  write_running(0);
  const auto told = sut_.look(tasks_, now_);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_THAT(std::string(dds::text_of(told[0].text)), testing::HasSubstr("not known"));
}

TEST_F(RunWatchTest, LooksAtABoundedNumberOfTasksAtATimeInTurns) {
  constexpr std::size_t kEvents = 64;
  for (std::uint64_t i = 1; i <= RunWatch::kMaxOfClient; ++i) {
    AwaitedPost batch = post(i, "ready", i == 1 ? 2 : 1);
    batch.targets.resize(kEvents, batch.targets.front());
    sut_.add(batch, tasks_);
  }
  write_cycle(1, microseconds(10));
  std::size_t told = 0;
  std::size_t calls = 0;
  for (; told < RunWatch::kMaxOfClient - 1; ++calls) {
    const auto some = sut_.look(tasks_, now_);
    ASSERT_LE(some.size() * kEvents, RunWatch::kAtOnce);
    told += some.size();
    ASSERT_LT(calls, 1000U);
  }
  EXPECT_GE(calls, RunWatch::kMaxOfClient * kEvents / RunWatch::kAtOnce - 1);
  EXPECT_FALSE(sut_.empty()) << "one is still waited for";
}

TEST_F(RunWatchTest, TellsThatTheTaskWasStopped) {
  sut_.add(post(1, "ready", 1), tasks_);
  write_running(0);
  const auto told = sut_.look(tasks_, now_);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, static_cast<int>(ErrorCode::wrong_state));
  EXPECT_THAT(std::string(dds::text_of(told[0].text)), testing::HasSubstr("line1/Fill"));
}

TEST_F(RunWatchTest, TellsThatTheProcessIsGone) {
  sut_.add(post(1, "ready", 1), tasks_);
  (void)tasks_.forget("line1");
  const auto told = sut_.look(tasks_, now_);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, static_cast<int>(ErrorCode::wrong_state));
}

TEST_F(RunWatchTest, WaitsNoLongerThanItsLimit) {
  sut_.add(post(1, "ready", 1), tasks_);
  EXPECT_TRUE(sut_.look(tasks_, now_ + RunWatch::kLimit - microseconds(1)).empty());
  const auto told = sut_.look(tasks_, now_ + RunWatch::kLimit);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, static_cast<int>(ErrorCode::timed_out));
}

TEST_F(RunWatchTest, WaitsForABoundedNumberOfPostsOfOneClient) {
  for (std::uint64_t i = 1; i <= RunWatch::kMaxOfClient + 1; ++i) sut_.add(post(i, "ready", 1), tasks_);
  const auto told = sut_.look(tasks_, now_);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].sequence_number, RunWatch::kMaxOfClient + 1);
  EXPECT_EQ(told[0].code, static_cast<int>(ErrorCode::full));
  AwaitedPost by_another_writer = post(1, "ready", 1);
  by_another_writer.source.bytes.back() ^= 0xff;
  sut_.add(by_another_writer, tasks_);
  EXPECT_EQ(sut_.look(tasks_, now_).size(), 1U) << "a client with more writers has no more of them";

  AwaitedPost other = post(1, "ready", 1);
  other.source.bytes[0] = 2;
  sut_.add(other, tasks_);
  EXPECT_TRUE(sut_.look(tasks_, now_).empty());
}

}  // namespace
}  // namespace plchost
