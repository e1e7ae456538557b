#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "instances/runtime/setup/set_up_watch.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::IsEmpty;

class ThreadsInSetUp final : public ProcessorTimes {
 public:
  [[nodiscard]] Duration of_process() const noexcept override { return {}; }
  [[nodiscard]] Duration of_thread(pid_t thread) const noexcept override { return used.at(thread); }
  [[nodiscard]] Duration ready_time_of_thread(pid_t thread) const noexcept override {
    const auto known = ready.find(thread);
    return known == ready.end() ? Duration::zero() : known->second;
  }
  [[nodiscard]] bool sleeps(pid_t) const noexcept override { return false; }
  [[nodiscard]] std::size_t real_time_threads(std::span<pid_t> found) const noexcept override {
    std::size_t count = 0;
    for (const auto& [thread, time] : used) {
      if (std::ranges::find(demoted, thread) == demoted.end()) found[count++] = thread;
    }
    return count;
  }
  [[nodiscard]] ThreadText demote(pid_t thread) const noexcept override {
    demoted.push_back(thread);
    return ThreadText("thread " + std::to_string(thread));
  }

  std::map<pid_t, Duration> used;
  std::map<pid_t, Duration> ready;
  mutable std::vector<pid_t> demoted;
};

class LongRun : public testing::Test {
 protected:
  /// So many looks, between which each thread gets its part of the time in percent.
  std::optional<ProcessorGuard::Taker> looks(int count, const std::map<pid_t, int>& percent,
                                             Duration step = milliseconds(50)) {
    for (int i = 0; i < count; ++i) {
      now_ += step;
      for (const auto& [thread, part] : percent) threads_.used[thread] += step * part / 100;
      if (auto taker = sut_.look(now_)) return taker;
    }
    return std::nullopt;
  }

  ThreadsInSetUp threads_;
  pid_t elsewhere_ = 9;
  TimePoint now_{std::chrono::seconds(100)};
  LongRunSearch sut_{threads_, milliseconds(1000), [this](pid_t thread) { return thread != elsewhere_; }};
};

TEST_F(LongRun, IsFoundAfterTheLimitAndOnce) {
  EXPECT_FALSE(looks(21, {{7, 100}}));
  const auto taker = looks(1, {{7, 100}});
  ASSERT_TRUE(taker);
  EXPECT_EQ(taker->who.view(), "thread 7");
  EXPECT_EQ(taker->lasted, milliseconds(1050));
  EXPECT_FALSE(looks(50, {}));
  EXPECT_THAT(threads_.demoted, ElementsAre(7));
}

TEST_F(LongRun, BeginsAnewAfterAPause) {
  EXPECT_FALSE(looks(20, {{7, 100}}));
  EXPECT_FALSE(looks(1, {{7, 0}}, milliseconds(150)));
  EXPECT_FALSE(looks(20, {{7, 100}}));
  EXPECT_TRUE(looks(1, {{7, 100}}));
}

// So it does to the thread that looks, if that has a real-time priority. The looks are close together.
TEST_F(LongRun, IsFoundThoughTheKernelStopsRealTimeThreadsFor50MsOfEachSecond) {
  EXPECT_FALSE(looks(19, {{7, 100}}));
  EXPECT_FALSE(looks(1, {{7, 0}}));
  EXPECT_TRUE(looks(2, {{7, 100}}));
}

// The kernel leaves 50 ms of each second to threads without real-time priority: the looks are that far apart.
TEST_F(LongRun, IsFoundByLooksThatComeLate) {
  EXPECT_TRUE(looks(4, {{7, 95}}, milliseconds(1000)));
}

// Threads above it, also of other programs: with them it takes all of the processor.
TEST_F(LongRun, IsFoundThoughOthersTakeAThirdOfTheProcessorFromIt) {
  for (int i = 0; i < 22; ++i) {
    threads_.ready[7] += milliseconds(17);
    EXPECT_EQ(looks(1, {{7, 66}}).has_value(), i == 21);
  }
}

TEST_F(LongRun, IsThatOfTheThreadThatRunsNotOfTheOneThatWaitsForIt) {
  for (int i = 0; i < 22; ++i) {
    threads_.ready[5] += milliseconds(49);
    const auto taker = looks(1, {{5, 2}, {7, 100}});
    ASSERT_EQ(taker.has_value(), i == 21);
  }
  EXPECT_THAT(threads_.demoted, ElementsAre(7));
}

TEST_F(LongRun, OfAThreadOnAnotherCoreTakesNothing) {
  EXPECT_FALSE(looks(100, {{elsewhere_, 100}, {7, 50}}));
  EXPECT_THAT(threads_.demoted, IsEmpty());
}

// While the process stood still, so did its threads.
TEST_F(LongRun, IsNoneWhileTheProcessIsStopped) {
  EXPECT_FALSE(looks(10, {{7, 100}}));
  now_ += std::chrono::seconds(20);
  EXPECT_FALSE(sut_.look(now_));
  EXPECT_FALSE(looks(20, {{7, 100}}));
}

}  // namespace
}  // namespace plchost
