#include "shm/process/work_limit.hpp"

#include <atomic>
#include <csignal>
#include <cstddef>
#include <thread>

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr TimePoint kBegan{seconds(100)};

TEST(WorkLimit, IsThatOfAClockOnAnIdleMachine) {
  const WorkLimit sut(seconds(10), kBegan);
  EXPECT_EQ(sut.left(kBegan, {}), seconds(10));
  EXPECT_EQ(sut.left(kBegan + seconds(4), {.ran = seconds(1), .waited = {}}), seconds(6));
  EXPECT_EQ(sut.left(kBegan + seconds(10), {.ran = seconds(10), .waited = {}}), Duration::zero());
  EXPECT_EQ(sut.left(kBegan + seconds(10), {}), Duration::zero()) << "it sleeps";
  EXPECT_EQ(sut.left(kBegan + milliseconds(9999), {}), WorkLimit::kLook);
}

TEST(WorkLimit, DoesNotCountTheTimeInWhichOthersHaveTheProcessor) {
  const WorkLimit sut(seconds(10), kBegan);
  EXPECT_EQ(sut.left(kBegan + seconds(10), {.ran = seconds(1), .waited = seconds(7)}), seconds(7));
  EXPECT_EQ(sut.left(kBegan + seconds(17), {.ran = seconds(1), .waited = seconds(7)}), Duration::zero());
  EXPECT_EQ(sut.left(kBegan + seconds(40), {.ran = seconds(1), .waited = seconds(39)}), seconds(9));
}

TEST(WorkLimit, IsThatOfAClockForAProcessThatComputesForEver) {
  const WorkLimit sut(seconds(10), kBegan);
  EXPECT_EQ(sut.left(kBegan + seconds(9), {.ran = seconds(2), .waited = seconds(7)}), seconds(1));
  EXPECT_EQ(sut.left(kBegan + seconds(10), {.ran = seconds(2), .waited = seconds(8)}), Duration::zero());
  EXPECT_EQ(sut.left(kBegan + seconds(30), {.ran = seconds(2), .waited = seconds(28)}), Duration::zero());
}

TEST(WorkLimit, IsAtMostFiveTimesAsLong) {
  const WorkLimit sut(seconds(10), kBegan);
  EXPECT_EQ(sut.left(kBegan + seconds(49), {.ran = seconds(1), .waited = seconds(48)}), seconds(1));
  EXPECT_EQ(sut.left(kBegan + seconds(50), {.ran = seconds(1), .waited = seconds(49)}), Duration::zero())
      << "a thread that waits excuses another one that hangs, but not for ever";
}

TEST(WorkLimit, CountsTheTimeThatItsThreadsTakeFromEachOther) {
  const WorkLimit sut(seconds(10), kBegan);
  EXPECT_EQ(sut.left(kBegan + seconds(10), {.ran = seconds(10), .waited = seconds(90)}), Duration::zero());
  EXPECT_EQ(sut.left(kBegan + seconds(20), {.ran = seconds(10), .waited = seconds(90)}), Duration::zero());
}

TEST(WorkLimit, BeginsWithWhatWasBefore) {
  const WorkLimit sut(seconds(10), kBegan, {.ran = seconds(5), .waited = seconds(50)});
  EXPECT_EQ(sut.left(kBegan + seconds(4), {.ran = seconds(6), .waited = seconds(52)}), seconds(8));
  EXPECT_EQ(sut.left(kBegan + seconds(10), {}), Duration::zero()) << "it has ended";
}

TEST(WorkLimit, KnowsAWaitThatHasNotEnded) {
  const WorkLimit sut(seconds(10), kBegan);
  EXPECT_EQ(sut.left(kBegan + seconds(10), {.ran = seconds(1), .waited = seconds(2)}, seconds(6)),
            seconds(6));
  EXPECT_EQ(sut.left(kBegan + seconds(20), {.ran = seconds(5), .waited = {}}, seconds(12)), seconds(2));
}

// Two threads on one core: each waits about as long as the other one runs.
void compete_for_a_core() {
  cpu_set_t allowed;
  ASSERT_EQ(::sched_getaffinity(0, sizeof allowed, &allowed), 0);
  std::size_t core = 0;
  while (!CPU_ISSET(core, &allowed)) ++core;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(core, &one);
  std::atomic<bool> stop{false};
  const auto spin = [&] {
    (void)::sched_setaffinity(0, sizeof one, &one);
    while (!stop.load(std::memory_order_relaxed)) {
    }
  };
  std::thread first(spin);
  std::thread second(spin);
  const TimePoint end = MonotonicClock::now() + seconds(20);
  const ProcessorShare before = processor_share_of(::getpid());
  ProcessorShare now = before;
  while ((now.waited - before.waited < milliseconds(50) || now.ran - before.ran < milliseconds(50)) &&
         MonotonicClock::now() < end) {
    std::this_thread::sleep_for(milliseconds(10));
    now = processor_share_of(::getpid());
  }
  stop.store(true);
  first.join();
  second.join();
  EXPECT_GE(now.waited - before.waited, milliseconds(50));
  EXPECT_GE(now.ran - before.ran, milliseconds(50));
}

TEST(ProcessorShare, TellsHowLongThreadsHaveWaited) {
  compete_for_a_core();
}

TEST(ProcessorShare, IsAlsoThatOfProcessesThatTheProcessHasStarted) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (volatile bool go_on = true; go_on;) {
    }
  }
  ASSERT_GT(child, 0);
  const Duration own = processor_time_of(::getpid());
  const TimePoint end = MonotonicClock::now() + seconds(20);
  while (processor_time_of(child) < milliseconds(50) && MonotonicClock::now() < end) {
    std::this_thread::sleep_for(milliseconds(5));
  }
  const Duration both = processor_share_of(::getpid()).ran;
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_GE(both - own, milliseconds(40));
}

TEST(ProcessorShare, OfAProcessThatHasEndedIsZero) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(0);
  ::waitpid(child, nullptr, 0);
  const ProcessorShare share = processor_share_of(child);
  EXPECT_EQ(share.ran, Duration::zero());
  EXPECT_EQ(share.waited, Duration::zero());
}

}  // namespace
}  // namespace plchost
