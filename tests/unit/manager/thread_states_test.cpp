#include "manager/system/thread_states.hpp"

#include <csignal>
#include <optional>
#include <string_view>

#include <gmock/gmock.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/process/work_limit.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

constexpr std::string_view kText =
    "812 (a) S (b) R 1 812 812 0 -1 4194368 95 0 0 0 150 25 0 0 -51 -3 1 0 99 5 6 18446744073709551615 1 1 0 "
    "0 0 0 0 0 0 0 0 0 17 3 50 1 0 0 0 0 0 0 0 0 0 0 0\n";

TEST(ThreadState, IsReadFromWhatTheKernelSays) {
  const auto sut = parse_thread_state(kText);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->id, 812);
  EXPECT_EQ(sut->name, "a) S (b");
  EXPECT_TRUE(sut->ready);
  EXPECT_EQ(sut->used, std::chrono::milliseconds(1750 * 100 / ::sysconf(_SC_CLK_TCK)));
  EXPECT_EQ(sut->nice, -3);
  EXPECT_EQ(sut->core, 3);
  EXPECT_EQ(sut->priority, 50);
  EXPECT_EQ(sut->policy, unsigned{SCHED_FIFO});
}

TEST(ThreadState, IsNoneInACutText) {
  for (std::size_t length = 0; length < kText.rfind("50 1 ") + 3; ++length) {
    EXPECT_FALSE(parse_thread_state(kText.substr(0, length))) << length;
  }
}

TEST(ThreadState, OfAnotherProcessIsFoundByItsCoreAndPriority) {
  if (!Thread::start("probe", {.fifo = 1}, [] {})) GTEST_SKIP() << "no right to SCHED_FIFO";
  const int core = allowed_cores(0).value().back();
  const pid_t other = ::fork();
  if (other == 0) {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(static_cast<std::size_t>(core), &one);
    const sched_param highest{.sched_priority = 99};
    (void)::sched_setaffinity(0, sizeof one, &one);
    (void)::sched_setscheduler(0, SCHED_FIFO, &highest);
    ::alarm(10);
    for (;;) continue;
  }
  std::optional<ThreadState> found;
  for (int i = 0; i < 1000 && (!found || found->process != other || found->priority == 0); ++i) {
    ::usleep(1000);
    found = first_on_cores({core}, ::getppid());
  }
  ::kill(other, SIGKILL);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->process, other);
  EXPECT_THAT(describe(*found), StartsWith("program 'unit_manager' (process "));
  EXPECT_THAT(describe(*found), HasSubstr(", SCHED_FIFO 99)"));
  EXPECT_GT(processor_time_of(::getpid()), Duration::zero());
  ::waitpid(other, nullptr, 0);
}

}  // namespace
}  // namespace plchost
