#include "manager/system/reactor.hpp"

#include <csignal>
#include <vector>

#include <gmock/gmock.h>
#include <sys/epoll.h>
#include <unistd.h>

#include "manager/system/child_process.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

TEST(Reactor, CallsTimersInTheOrderOfTheirTimes) {
  auto sut = std::move(*Reactor::create());
  std::vector<int> order;
  Reactor::Timer late(*sut, [&] {
    order.push_back(2);
    sut->stop();
  });
  Reactor::Timer early(*sut, [&] { order.push_back(1); });
  Reactor::Timer cancelled(*sut, [&] { order.push_back(3); });
  const TimePoint now = MonotonicClock::now();
  late.set(now + milliseconds(20));
  early.set(now + milliseconds(10));
  cancelled.set(now + milliseconds(5));
  cancelled.cancel();
  ASSERT_TRUE(sut->run());
  EXPECT_THAT(order, testing::ElementsAre(1, 2));
}

TEST(Reactor, LetsAWatchRemoveItselfAndOthersWhileItIsCalled) {
  auto sut = std::move(*Reactor::create());
  auto pipe = std::move(*make_output_pipe());
  auto other = std::move(*make_output_pipe());
  ASSERT_EQ(::write(pipe.write_end.get(), "x", 1), 1);
  ASSERT_EQ(::write(other.write_end.get(), "x", 1), 1);
  int calls = 0;
  Reactor::Watch first;
  Reactor::Watch second;
  const auto remove_both = [&](std::uint32_t) {
    ++calls;
    first.reset();
    second.reset();
    sut->stop();
  };
  first = std::move(*sut->watch(pipe.read_end.get(), EPOLLIN, remove_both));
  second = std::move(*sut->watch(other.read_end.get(), EPOLLIN, remove_both));
  ASSERT_TRUE(sut->run());
  EXPECT_EQ(calls, 1);
}

TEST(Reactor, TurnsSignalsIntoCalls) {
  auto sut = std::move(*Reactor::create());
  int received = 0;
  ASSERT_TRUE(sut->watch_signals({SIGUSR2}, [&](int signal) {
    received = signal;
    sut->stop();
  }));
  ::raise(SIGUSR2);
  ASSERT_TRUE(sut->run());
  EXPECT_EQ(received, SIGUSR2);
}

/// Runs a shell command to its end.
ExitStatus run_to_end(const std::string& command, int output_fd = -1) {
  auto reactor = std::move(*Reactor::create());
  auto process = std::move(*spawn_process({.arguments = {"/bin/sh", "-c", command}, .output_fd = output_fd}));
  ExitStatus status;
  const auto watch = reactor->watch(process.pidfd.get(), EPOLLIN, [&](std::uint32_t) {
    status = reap_process(process);
    reactor->stop();
  });
  EXPECT_TRUE(watch && reactor->run());
  return status;
}

TEST(ChildProcess, SaysInWordsHowItEnded) {
  EXPECT_EQ(run_to_end("exit 0").describe(), "exit code 0");
  EXPECT_EQ(run_to_end("exit 3").describe(), "exit code 3");
  EXPECT_EQ(run_to_end("kill -SEGV $$").describe(), "killed by SIGSEGV");
  EXPECT_FALSE(ExitStatus{.known = false}.success());
  EXPECT_EQ(ExitStatus{.known = false}.describe(), "ended (status unknown: it was adopted)");
}

TEST(ChildProcess, StartsWithNothingBlockedAndNoOtherDescriptor) {
  // Signals that the manager blocks or ignores, and its open files, must not reach a PLC.
  sigset_t set;
  sigset_t before;
  sigfillset(&set);
  pthread_sigmask(SIG_BLOCK, &set, &before);
  std::signal(SIGUSR1, SIG_IGN);
  const auto leaked = UniqueFd(::dup(STDERR_FILENO));
  auto pipe = std::move(*make_output_pipe());
  run_to_end("exec grep -E 'SigBlk|SigIgn' /proc/self/status", pipe.write_end.get());
  run_to_end("exec ls /proc/self/fd", pipe.write_end.get());
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  std::signal(SIGUSR1, SIG_DFL);
  const std::string output = read_available(pipe.read_end.get(), 4096);
  // Signals 32 and 33 are the C library's own; descriptor 3 is the folder that ls reads.
  EXPECT_THAT(output, testing::MatchesRegex(
                          "SigBlk:\t0000000000000000\nSigIgn:\t0000000[01][08]0000000\n0\n1\n2\n3\n"));
}

TEST(ChildProcess, FailsIfThereIsNoSuchProgram) {
  const auto sut = spawn_process({.arguments = {"/nowhere/plc-instance"}});
  ASSERT_FALSE(sut.has_value());
  EXPECT_THAT(sut.error().describe(), testing::HasSubstr("start /nowhere/plc-instance"));
}

TEST(ChildProcess, KnowsTheCoresOfAProcess) {
  EXPECT_FALSE(cores_of_process(::getpid()).empty());
}

}  // namespace
}  // namespace plchost
