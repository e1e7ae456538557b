// Signals of a manager that has no CAP_KILL to processes of the user that instances run as.
#include <csignal>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <linux/capability.h>
#include <poll.h>
#include <unistd.h>

#include "manager/system/child_process.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/process/capabilities.hpp"
#include "tests/support/in_a_child.hpp"

namespace plchost {
namespace {

constexpr uid_t kInstanceUser = 64045;  // of no account, and trusted by no other test

/// A process of that user, and one that it has left in its session.
Result<ChildProcess> start_instance() {
  auto process = spawn_process(
      {.arguments = {"/usr/bin/setpriv", "--reuid", fmt::format("{}", kInstanceUser), "--clear-groups",
                     "/bin/sh", "-c", "exec >/dev/null 2>&1; sleep 1000 & exec sleep 1000"}});
  for (int i = 0; process && i < 500 && user_of_process(process->pid) != kInstanceUser; ++i) ::usleep(10'000);
  return process;
}

bool has_ended(const ChildProcess& process) {
  pollfd end{.fd = process.pidfd.get(), .events = POLLIN, .revents = 0};
  return ::poll(&end, 1, 10'000) == 1;
}

class SignalsToInstances : public testing::Test {
 protected:
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "only root has instances of another user";
    if (::access("/usr/bin/setpriv", X_OK) != 0) GTEST_SKIP() << "no setpriv";
  }
};

TEST_F(SignalsToInstances, ReachThemWithoutCapKillAndNobodyElse) {
  EXPECT_EQ(in_a_child([] {
              const auto stranger = start_instance();
              if (!stranger || !keep_capabilities({CAP_SETUID, CAP_SETGID})) return std::string("no set-up");
              const bool refused = !signal_process(*stranger, SIGCONT);
              (void)trust_instances_of(kInstanceUser);
              const bool sent = signal_process(*stranger, SIGKILL).has_value();
              const bool ended = has_ended(*stranger);
              end_session(*stranger);
              return fmt::format("refused {} sent {} ended {} root {}", refused, sent, ended,
                                 ::geteuid() == 0);
            }),
            "refused true sent true ended true root true");
}

TEST_F(SignalsToInstances, EndWhatAnInstanceHasLeftInItsSession) {
  EXPECT_EQ(in_a_child([] {
              (void)trust_instances_of(kInstanceUser);
              const auto instance = start_instance();
              if (!instance || !keep_capabilities({CAP_SETUID, CAP_SETGID})) return std::string("no set-up");
              ::usleep(200'000);  // the shell starts the other one
              (void)signal_process(*instance, SIGKILL);
              const bool ended = has_ended(*instance);
              const bool left = ::kill(-instance->pid, 0) == 0 || errno == EPERM;
              end_session(*instance);
              (void)reap_process(*instance);
              bool gone = false;
              for (int i = 0; i < 500 && !gone; ++i) {
                gone = ::kill(-instance->pid, 0) != 0 && errno == ESRCH;
                ::usleep(10'000);
              }
              return fmt::format("ended {} left {} gone {}", ended, left, gone);
            }),
            "ended true left true gone true");
}

}  // namespace
}  // namespace plchost
