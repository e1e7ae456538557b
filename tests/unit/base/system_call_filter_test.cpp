// System calls that a process gives up fail in all of its threads, whatever ABI it calls them by.
#include "shm/process/system_call_filter.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/process/capabilities.hpp"
#include "tests/support/in_a_child.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

constexpr std::array kGroup = {RefusedCall{SYS_getpgid, "getpgid"}};

/// Empty, or what is wrong.
std::string refuse(std::span<const RefusedCall> calls) {
  const auto rights = refuse_new_rights();
  const auto done = refuse_system_calls(calls);
  return rights && done ? "" : (rights ? done : rights).error().describe();
}

/// The errno of a system call; 0: it is done.
template <class... Arguments>
int error_of(long number, Arguments... arguments) {
  errno = 0;
  return ::syscall(number, arguments...) == -1 ? errno : 0;
}

TEST(SystemCallFilter, RefusesTheGivenCallsAndNoOthers) {
  EXPECT_EQ(in_a_child([] {
              const std::string wrong = refuse(kGroup);
              return fmt::format("{}{} {}", wrong, error_of(SYS_getpgid, 0), error_of(SYS_getpid));
            }),
            fmt::format("{} 0", EPERM));
}

TEST(SystemCallFilter, AddsItsCallsToThoseOfTheFilterBefore) {
  constexpr std::array kSession = {RefusedCall{SYS_getsid, "getsid"}};
  EXPECT_EQ(in_a_child([&] {
              const std::string wrong = refuse(kGroup) + refuse(kSession);
              return fmt::format("{}{} {}", wrong, error_of(SYS_getpgid, 0), error_of(SYS_getsid, 0));
            }),
            fmt::format("{0} {0}", EPERM));
}

TEST(SystemCallFilter, MayDependOnFlagsAndHaveAnotherError) {
  constexpr std::array kMask = {RefusedCall{SYS_umask, "umask", 0070, ENOSYS}};
  EXPECT_EQ(in_a_child([&] {
              const std::string wrong = refuse(kMask);
              return fmt::format("{}{} {} {}", wrong, error_of(SYS_umask, 0007), error_of(SYS_umask, 0027),
                                 error_of(SYS_umask, 0700));
            }),
            fmt::format("0 {} 0", ENOSYS));
}

TEST(SystemCallFilter, HoldsForThreadsThatAreThereAndForChildren) {
  EXPECT_EQ(in_a_child([] {
              std::atomic<bool> is_set = false;
              int of_thread = 0;
              std::thread before([&] {
                is_set.wait(false);
                of_thread = error_of(SYS_getpgid, 0);
              });
              const std::string wrong = refuse(kGroup);
              is_set = true;
              is_set.notify_all();
              before.join();
              const pid_t child = ::fork();
              if (child == 0) ::_exit(error_of(SYS_getpgid, 0));
              int status = 0;
              ::waitpid(child, &status, 0);
              return fmt::format("{}{} {}", wrong, of_thread, WEXITSTATUS(status));
            }),
            fmt::format("{0} {0}", EPERM));
}

// By the same number as one that is refused, and by any other.
TEST(SystemCallFilter, RefusesCallsOfX32) {
#ifdef __x86_64__
  constexpr long kX32 = 0x40000000;
  EXPECT_EQ(in_a_child([] {
              const std::string wrong = refuse(kGroup);
              return fmt::format("{}{} {}", wrong, error_of(kX32 | SYS_getpgid, 0),
                                 error_of(kX32 | SYS_getpid));
            }),
            fmt::format("{0} {0}", EPERM));
#else
  GTEST_SKIP() << "only processors of x86-64 have that ABI";
#endif
}

#ifdef __x86_64__
/// getpid() as a program of i386 calls it: the result, or minus an errno.
int getpid_of_i386() {
  constexpr int kNumber = 20;
  int result = kNumber;
  asm volatile("int $0x80" : "+a"(result) : : "memory", "cc", "r8", "r9", "r10", "r11");
  return result;
}
#endif

TEST(SystemCallFilter, RefusesCallsOfI386) {
#ifdef __x86_64__
  const auto works = [] { return getpid_of_i386() == ::getpid() ? "yes" : "no"; };
  if (in_a_child([&] {
        (void)std::signal(SIGSEGV, SIG_DFL);
        return works();
      }) != "yes") {
    GTEST_SKIP() << "this kernel has no system calls of i386";
  }
  EXPECT_EQ(in_a_child([] {
              const std::string wrong = refuse(kGroup);
              return fmt::format("{}{}", wrong, getpid_of_i386());
            }),
            fmt::format("{}", -EPERM));
#else
  GTEST_SKIP() << "only processors of x86-64 have that ABI";
#endif
}

// A filter that held for a part of the threads would be none.
TEST(SystemCallFilter, FailsBesideAThreadWithAFilterOfItsOwn) {
  const std::string text = in_a_child([] {
    std::atomic<pid_t> filtered = 0;
    std::atomic<bool> ends = false;
    const std::string wrong = refuse({});  // no_new_privs, for the thread
    std::thread other([&] {
      sock_filter all = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
      const sock_fprog program{.len = 1, .filter = &all};
      (void)::syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, 0, &program);
      filtered = ::gettid();
      filtered.notify_all();
      ends.wait(false);
    });
    filtered.wait(0);
    const std::string refused = refuse(kGroup);
    const int still = error_of(SYS_getpgid, 0);
    ends = true;
    ends.notify_all();
    other.join();
    return fmt::format("{}{} for {}: {}", wrong, still, filtered.load(), refused);
  });
  EXPECT_THAT(text, StartsWith("0 for "));
  EXPECT_THAT(text, HasSubstr("has one of its own"));
}

TEST(SystemCallFilter, SaysThatTheKernelHasNone) {
  constexpr std::array kSeccomp = {RefusedCall{SYS_seccomp, "seccomp", 0, EINVAL}};
  EXPECT_EQ(in_a_child([&] {
              const std::string wrong = refuse(kSeccomp);
              return wrong + refuse(kGroup);
            }),
            "cannot set a filter of system calls (seccomp): Invalid argument (EINVAL)");
}

}  // namespace
}  // namespace plchost
