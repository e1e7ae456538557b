#include "shm/threads/thread.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

namespace {
std::atomic<std::int64_t> wall_clock_ahead_s{0};
}

// In place of the C library's, for the whole program: the clock on the wall can be wrong, as when somebody
// sets it back while a thread waits.
extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const auto result = ::syscall(SYS_clock_gettime, clock, time);
  if (clock == CLOCK_REALTIME && result == 0) time->tv_sec += wall_clock_ahead_s.load();
  return static_cast<int>(result);
}

namespace plchost {
namespace {

using testing::HasSubstr;

TEST(Thread, RunsItsBodyWithItsNameAndJoinsAtTheEnd) {
  std::string name;
  {
    auto sut = Thread::start("a-name-that-is-too-long", {}, [&] {
      std::array<char, 16> buffer{};
      pthread_getname_np(pthread_self(), buffer.data(), buffer.size());
      name = buffer.data();
    });
    ASSERT_TRUE(sut) << sut.error().describe();
    EXPECT_TRUE(sut->joinable());
  }
  EXPECT_EQ(name, "a-name-that-is-");
}

TEST(Thread, MovesOwnership) {
  std::atomic<int> runs{0};
  auto first = Thread::start("first", {}, [&] { ++runs; });
  auto second = Thread::start("second", {}, [&] { ++runs; });
  ASSERT_TRUE(first && second);
  Thread sut = std::move(*first);
  sut = std::move(*second);  // joins the first
  EXPECT_FALSE(second->joinable());
  sut.join();
  EXPECT_FALSE(sut.joinable());
  EXPECT_EQ(runs, 2);
}

TEST(Thread, IsJoinedWhenItEndsOrIsAbandonedWhateverTheClockOnTheWallIs) {
  std::atomic<bool> end{false};
  auto sut = Thread::start("waits", {}, [&] {
    while (!end) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  ASSERT_TRUE(sut);
  wall_clock_ahead_s = 3600;
  int looks = 0;
  EXPECT_FALSE(sut->join_until(MonotonicClock::now() + std::chrono::milliseconds(50), [&] {
    ++looks;
    return false;
  })) << "by the other clock that is in an hour";
  EXPECT_GT(looks, 1);
  wall_clock_ahead_s = 0;
  end = true;
  EXPECT_TRUE(sut->join_until(MonotonicClock::now() + std::chrono::seconds(20), [] { return false; }));
}

TEST(Thread, IsNotFifoUnlessAskedFor) {
  int policy = -1;
  int nice = -1;
  auto sut = Thread::start("soft", {.fifo = 0, .nice = 3}, [&] {
    policy = ::sched_getscheduler(0);
    nice = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()));
  });
  ASSERT_TRUE(sut);
  sut->join();
  EXPECT_EQ(policy, SCHED_OTHER);
  EXPECT_EQ(nice, 3);
}

TEST(Thread, IsFifoOrSaysWhatIsMissing) {
  int policy = -1;
  auto sut = Thread::start("hard", {.fifo = 2}, [&] { policy = ::sched_getscheduler(0); });
  if (sut) {
    sut->join();
    EXPECT_EQ(policy & ~SCHED_RESET_ON_FORK, SCHED_FIFO);
  } else {
    EXPECT_EQ(sut.error().code, ErrorCode::refused);
    EXPECT_THAT(sut.error().message, HasSubstr("CAP_SYS_NICE"));
  }
}

TEST(Thread, HandsItsPriorityToNoThreadThatItMakesUnlessAskedTo) {
  int inherited = -1;
  int asked_for = -1;
  auto sut = Thread::start("hard", {.fifo = 2}, [&] {
    std::thread([&] { inherited = ::sched_getscheduler(0); }).join();
    auto explicitly = Thread::start("asked", {.fifo = 1}, [&] { asked_for = ::sched_getscheduler(0); });
  });
  if (!sut) GTEST_SKIP() << sut.error().describe();
  sut->join();
  EXPECT_EQ(inherited, SCHED_OTHER);
  EXPECT_EQ(asked_for & ~SCHED_RESET_ON_FORK, SCHED_FIFO);
}

TEST(Thread, RefusesAPriorityThatDoesNotExist) {
  EXPECT_FALSE(Thread::start("odd", {.fifo = 100}, [] {}));
}

TEST(Cores, BindsAllThreadsAndReadsBack) {
  const auto before = allowed_cores(0);
  ASSERT_TRUE(before);
  ASSERT_FALSE(before->empty());
  std::atomic<bool> stop{false};
  std::atomic<pid_t> tid{0};
  auto thread = Thread::start("other", {}, [&] {
    tid = ::gettid();
    while (!stop) ::usleep(1000);
  });
  ASSERT_TRUE(thread);
  while (tid == 0) ::usleep(1000);
  const std::vector<int> one = {before->front()};
  EXPECT_EQ(bind_process_to_cores(0, one), one);
  EXPECT_EQ(allowed_cores(tid), one);
  EXPECT_EQ(bind_process_to_cores(::getpid(), *before), *before);
  stop = true;
}

TEST(Cores, RefusesCoresThatDoNotExist) {
  EXPECT_EQ(bind_process_to_cores(0, {-1}).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(bind_process_to_cores(0, {100'000}).error().code, ErrorCode::invalid_argument);
  EXPECT_FALSE(bind_process_to_cores(0, {CPU_SETSIZE - 1}));
}

TEST(Cores, BindingAProcessThatEndedFails) {
  EXPECT_FALSE(bind_process_to_cores(999'999'999, {0}));
}

TEST(Cores, OnlineOnesHoldTheAllowedOnes) {
  const auto online = online_cores();
  const auto allowed = allowed_cores(0);
  ASSERT_TRUE(online && allowed);
  for (const int core : *allowed) EXPECT_THAT(*online, testing::Contains(core));
}

}  // namespace
}  // namespace plchost
