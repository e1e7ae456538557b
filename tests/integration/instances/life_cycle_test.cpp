// The real plc-instance with real applications: its promises from start to end.
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shm/threads/thread.hpp"
#include "tests/integration/instances/instance_process.hpp"

namespace plchost::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class UnderEachScheduler : public ::testing::TestWithParam<const char*> {};

TEST_P(UnderEachScheduler, RunsTasksOfAllFourKinds) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--scheduler", GetParam(), "--application", application("all_kinds")});
  sut.wait_until_up();
  for (int i = 0; i < 100; ++i) EXPECT_EQ(sut.event("work").post(), PostResult::posted);
  EXPECT_TRUE(eventually([&] { return sut.task("Work")->counters.cycles == 100; }));
  EXPECT_TRUE(eventually([&] { return sut.task("Edge")->counters.cycles >= 2; }));
  EXPECT_TRUE(eventually([&] { return sut.task("Loop")->counters.cycles >= 10; }));
  const auto figures = sut.figures();
  EXPECT_EQ(figures.works, 100U);
  EXPECT_GE(figures.ticks, 50U);
  EXPECT_GE(figures.edges, 2U);
  EXPECT_GE(figures.loops, 10U);
  EXPECT_EQ(sut.task("Fast")->state, PageTaskState::running);
  const std::string settings = sandbox.folder() + "/line1.settings";
  EXPECT_TRUE(eventually([&] { return std::filesystem::exists(settings); }));
  EXPECT_EQ(sut.end(SIGTERM), EXIT_SUCCESS);
  EXPECT_FALSE(InstancePageReader::open(sandbox.pool(), "line1"));
  EXPECT_FALSE(std::filesystem::exists(settings));
}

INSTANTIATE_TEST_SUITE_P(Schedulers, UnderEachScheduler,
                         ::testing::Values("CmpSchedule", "CmpScheduleTimer", "CmpScheduleOneShot"));

TEST(Instance, WritesCycleTimesAndJitterBackIntoTaskInfo) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--application", application("all_kinds")});
  sut.wait_until_up();
  EXPECT_TRUE(eventually([&] { return sut.task("Fast")->counters.cycles > 200; }));
  (void)sut.figures();
  int max = -1;
  int min = -1;
  int jitter = 0;
  std::string line;
  EXPECT_TRUE(eventually([&] { return !(line = sut.last_line_from("application: Fast max")).empty(); }));
  ASSERT_EQ(std::sscanf(line.c_str(), "application: Fast max %d min %d jitter %d", &max, &min, &jitter), 3);
  EXPECT_GE(max, min);
  EXPECT_GE(min, 0);
  EXPECT_NE(jitter, 0);  // hundreds of cycles without a microsecond of deviation are not of this world
}

TEST(Instance, PostsAreRunOrLostAlsoThoseWhileItIsStopped) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--application", application("all_kinds")});
  sut.wait_until_up();
  PoolEvent event = sut.event("work");
  std::atomic<bool> enough{false};
  std::jthread poster([&] {
    while (!enough) {
      (void)event.post();
      std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
  });
  for (int round = 0; round < 10; ++round) {
    EXPECT_EQ(sut.ask(ControlVerb::stop).code, ErrorCode::ok);
    EXPECT_EQ(sut.ask(ControlVerb::start).code, ErrorCode::ok);
  }
  enough = true;
  poster.join();
  EXPECT_EQ(sut.ask(ControlVerb::stop).code, ErrorCode::ok);
  for (int i = 0; i < 1000; ++i) (void)event.post();
  const std::uint64_t posts = event.counted().count();
  EXPECT_GT(posts, 1000U);
  EXPECT_TRUE(eventually([&] {
    const auto work = sut.task("Work");
    return work && work->counters.cycles + work->counters.lost_events == posts;
  }));
  const TaskCounters counters = sut.task("Work")->counters;
  EXPECT_EQ(counters.cycles + counters.lost_events, posts);
  EXPECT_GE(counters.lost_events, 1000U);
}

TEST(Instance, APostWhoseMakerEndedBeforeTheWakeIsRunWithoutAnother) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--application", application("all_kinds")});
  sut.wait_until_up();
  ASSERT_EQ(sut.event("work").post(), PostResult::posted);
  ASSERT_TRUE(eventually([&] { return sut.task("Work")->counters.cycles == 1; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  constexpr std::uint64_t kOnePost = std::uint64_t{1} << 16;
  CountedEvent& event = sut.event("work").counted();
  reinterpret_cast<std::atomic<std::uint64_t>&>(event).fetch_add(kOnePost);
  EXPECT_TRUE(eventually([&] { return sut.task("Work")->counters.cycles == 2; }));
}

TEST(Instance, SwitchOfSchedulerKeepsVariablesCountersAndEvents) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--application", application("all_kinds")});
  sut.wait_until_up();
  constexpr unsigned kPosts = 10'000;
  unsigned posted = 0;
  const std::vector<std::string> schedulers{"CmpScheduleOneShot", "CmpScheduleTimer", "CmpSchedule"};
  unsigned ticks_before = 0;
  for (unsigned round = 0; round < 10; ++round) {
    for (unsigned i = 0; i < kPosts / 10; ++i)
      posted += sut.event("work").post() == PostResult::posted ? 1U : 0U;
    EXPECT_EQ(sut.ask(ControlVerb::set_scheduler, schedulers[round % 3]).code, ErrorCode::ok);
    const unsigned ticks = sut.figures().ticks;
    EXPECT_GE(ticks, ticks_before);
    ticks_before = ticks;
  }
  EXPECT_EQ(posted, kPosts);
  EXPECT_TRUE(eventually([&] { return sut.task("Work")->counters.cycles >= kPosts; }));
  EXPECT_EQ(sut.figures().works, kPosts);
  EXPECT_EQ(sut.task("Work")->counters.lost_events, 0U);
}

TEST(Instance, EveryThreadIsBoundToItsCore) {
  const Sandbox sandbox;
  const int core = allowed_cores(0).value().back();
  InstanceProcess sut(sandbox, {"--core", std::to_string(core), "--application", application("all_kinds")});
  sut.wait_until_up();
  unsigned threads = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator("/proc/" + std::to_string(sut.pid()) + "/task")) {
    const auto thread = static_cast<pid_t>(std::stol(entry.path().filename().string()));
    EXPECT_EQ(allowed_cores(thread).value(), std::vector<int>{core});
    ++threads;
  }
  EXPECT_GE(threads, 9U);  // eight tasks and the control thread
  EXPECT_EQ(sut.runtime().core, core);
}

TEST(Instance, StartsFreshAfterKillWithNothingOfItsPredecessor) {
  const Sandbox sandbox;
  {
    InstanceProcess first(sandbox, {"--application", application("all_kinds")});
    first.wait_until_up();
    EXPECT_EQ(first.event("work").bound_tasks(), 1U);
    EXPECT_EQ(first.end(SIGKILL), -SIGKILL);
  }
  InstanceProcess sut(sandbox, {"--application", application("packer")});
  sut.wait_until_up();
  EXPECT_FALSE(sut.event("work").registered());
  EXPECT_EQ(sut.event("work").bound_tasks(), 0U);
  EXPECT_EQ(sut.event("work").post(), PostResult::not_registered);
  EXPECT_EQ(sut.event("product").post(), PostResult::posted);
  EXPECT_TRUE(eventually([&] { return sut.task("Product")->counters.cycles == 1; }));
}

TEST(Instance, CrashOfAThreadOfTheApplicationsOwnEndsTheProcessWithItsSignal) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--application", application("all_kinds")});
  sut.wait_until_up();
  (void)sut.event("crash").post();
  EXPECT_EQ(sut.end(), -SIGSEGV);
}

TEST(Instance, TaskThatNeverReturnsDoesNotKeepTheProcess) {
  const Sandbox sandbox;
  const std::string settings =
      sandbox.write("line1.cfg", "[CmpSchedule]\nWatchdog.DefaultTimeMs=0\nStop.OthersLimitMs=500\n");
  InstanceProcess sut(sandbox, {"--settings", settings, "--application", application("all_kinds")});
  sut.wait_until_up();
  (void)sut.event("hang").post();
  ASSERT_TRUE(eventually([&] { return sut.log().find("application: hangs") != std::string::npos; }));
  EXPECT_EQ(sut.end(SIGTERM), EXIT_FAILURE);
  EXPECT_THAT(sut.log(), HasSubstr("Hang"));
}

TEST(Instance, SecondProcessOfTheSameNameIsRefused) {
  const Sandbox sandbox;
  InstanceProcess first(sandbox, {"--application", application("all_kinds")});
  first.wait_until_up();
  InstanceProcess sut(sandbox, {"--application", application("packer")});
  EXPECT_EQ(sut.end(), 3);
  EXPECT_THAT(sut.log(), HasSubstr("an instance 'line1' runs already"));
  EXPECT_EQ(first.event("work").post(), PostResult::posted);  // the first one lost nothing
}

TEST(Instance, ComponentSetsTheEventOfATaskItWasToldOf) {
  const Sandbox sandbox;
  const std::string settings =
      sandbox.write("line1.cfg", "[ComponentManager]\nComponent.1=" + application("component") + "\n");
  InstanceProcess sut(sandbox, {"--settings", settings, "--application", application("all_kinds")});
  sut.wait_until_up();
  EXPECT_TRUE(eventually([&] { return sut.task("Work")->counters.cycles > 10; }));
  EXPECT_EQ(sut.end(SIGTERM), EXIT_SUCCESS);
  EXPECT_THAT(sut.log(), HasSubstr("component: CH_INIT3"));
  EXPECT_THAT(sut.log(), HasSubstr("component: event forgotten"));
  EXPECT_THAT(sut.log(), HasSubstr("exit after"));
}

TEST(Instance, ExamplesSayWhatTheyDo) {
  const Sandbox sandbox;
  for (const char* const example : {"bottling_line", "drive_axis", "packer"}) {
    InstanceProcess sut(sandbox, {"--application", application(example)});
    EXPECT_TRUE(eventually([&] { return sut.log().find("application: ") != std::string::npos; }))
        << sut.log();
    EXPECT_EQ(sut.end(SIGINT), EXIT_SUCCESS) << sut.log();
    EXPECT_THAT(sut.log(), Not(HasSubstr(" error plc-instance")));
  }
}

}  // namespace
}  // namespace plchost::testing
