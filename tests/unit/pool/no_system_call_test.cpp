#include <array>
#include <cstddef>
#include <functional>

#include <gtest/gtest.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/pool/object_pool.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

/// From here on any system call but the end of the process is the end of the process, by SIGSYS.
bool forbid_system_calls() {
  std::array<sock_filter, 4> program = {
      sock_filter BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      sock_filter BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit_group, 0, 1),
      sock_filter BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
      sock_filter BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS)};
  const sock_fprog filter{.len = program.size(), .filter = program.data()};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

/// The signal that a child died of which does `work` a thousand times and may not call the system; 0: none.
int signal_of(const std::function<void()>& work) {
  const pid_t child = ::fork();
  if (child == 0) {
    work();  // the work that a thread does only once
    if (!forbid_system_calls()) ::_exit(1);
    for (int i = 0; i < 1000; ++i) work();
    ::_exit(0);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status) || WEXITSTATUS(status) == 0);
  return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
}

class NoSystemCall : public testing::Test {
 protected:
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "sanitizers call the system themselves";
  }
  NoSystemCall() : pool_(std::move(ObjectPool::create(name_.get(), {.max_objects = 64}).value())) {}
  UniquePoolName name_;
  ObjectPool pool_;
};

TEST_F(NoSystemCall, IsNeededToPostWhenNobodyWaits) {
  const auto event = pool_.create_shared_event("e");
  EXPECT_EQ(signal_of([&] { (void)event->object.post(); }), 0);
  EXPECT_EQ(event->object.count(), 1001U);
}

TEST_F(NoSystemCall, IsNeededToLockAFreeMutex) {
  const auto mutex = pool_.create_mutex("m");
  EXPECT_EQ(signal_of([&] {
              if (mutex->object.lock() == ObjectStatus::done) (void)mutex->object.unlock();
            }),
            0);
}

TEST_F(NoSystemCall, IsNeededToTakeFromASemaphoreThatHasUnits) {
  const auto semaphore = pool_.create_semaphore("s", 0);
  EXPECT_EQ(signal_of([&] {
              (void)semaphore->object.post();
              (void)semaphore->object.wait();
            }),
            0);
}

TEST_F(NoSystemCall, WouldBeSeenIfThereWasOne) {
  EXPECT_EQ(signal_of([] { (void)::getppid(); }), SIGSYS);
}

}  // namespace
}  // namespace plchost
