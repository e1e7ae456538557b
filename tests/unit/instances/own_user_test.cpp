// An instance becomes another user for good, and keeps its real-time rights.
#include "instances/runtime/setup/own_user.hpp"

#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <linux/capability.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include "shm/process/capabilities.hpp"
#include "tests/support/in_a_child.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

std::string become(const std::string& user) {
  const auto done = become_user_of_instances(user, "there is no such pool");
  return done ? *done : done.error().describe();
}

std::string permitted() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("CapPrm")) return line.substr(8);
  }
  return "";
}

// Locked memory and a priority of real time, then both given back.
std::string real_time() {
  const bool locked = ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  (void)::munlockall();
  const sched_param parameter{.sched_priority = 88};
  const bool fifo = ::sched_setscheduler(0, SCHED_FIFO, &parameter) == 0;
  return fmt::format("locked {} fifo {}", locked, fifo);
}

bool limit(decltype(RLIMIT_RTPRIO) what, rlim_t most) {
  const rlimit both{.rlim_cur = most, .rlim_max = most};
  return ::setrlimit(what, &both) == 0;
}

class UserOfInstances : public testing::Test {
 protected:
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "only root becomes another user";
    if (in_a_child([] { return real_time(); }) != "locked true fifo true")
      GTEST_SKIP() << "there are no real-time rights to keep";
  }
};

TEST_F(UserOfInstances, NeedsNoCapabilityWithTheLimitsOfTheUnit) {
  if (in_a_child(
          [] { return limit(RLIMIT_RTPRIO, 99) && limit(RLIMIT_MEMLOCK, RLIM_INFINITY) ? "" : "no"; }) != "")
    GTEST_SKIP() << "needs CAP_SYS_RESOURCE";
  EXPECT_EQ(in_a_child([] {
              (void)limit(RLIMIT_RTPRIO, 99);
              (void)limit(RLIMIT_MEMLOCK, RLIM_INFINITY);
              const std::string done = become("64043");
              return fmt::format("{}; {} {}; {}", done, ::getuid(), permitted(), real_time());
            }),
            "runs as user 64043, without capabilities; 64043 0000000000000000; locked true fifo true");
}

TEST_F(UserOfInstances, KeepsTwoCapabilitiesWhereLimitsAreLow) {
  EXPECT_EQ(
      in_a_child([] {
        if (!limit(RLIMIT_RTPRIO, 0) || !limit(RLIMIT_MEMLOCK, 65536)) return std::string("no limit");
        // As the unit's manager, which can raise no limit.
        if (!keep_capabilities({CAP_SYS_NICE, CAP_IPC_LOCK, CAP_SETUID, CAP_SETGID}))
          return std::string("no capability is given up");
        const std::string done = become("64043");
        return fmt::format("{}; {}; {}", done, permitted(), real_time());
      }),
      "runs as user 64043, with CAP_SYS_NICE and CAP_IPC_LOCK only; 0000000000804000; locked true fifo true");
}

TEST_F(UserOfInstances, HasNoWayBackAndKeepsTheGroup) {
  EXPECT_EQ(in_a_child([] {
              if (::setegid(64041) != 0) return std::string("no other group");
              (void)become("64043");
              const bool back = ::setuid(0) == 0 || ::seteuid(0) == 0;
              return fmt::format("{} {} {} {}", ::geteuid(), ::getegid(), back, never_gains_rights());
            }),
            "64043 64041 false true");
}

TEST_F(UserOfInstances, IsNeitherRootNorNobodyKnown) {
  EXPECT_THAT(in_a_child([] { return become("root"); }), HasSubstr("root is no user with fewer rights"));
  EXPECT_THAT(in_a_child([] { return become("nobody here"); }), HasSubstr("there is no user 'nobody here'"));
}

TEST_F(UserOfInstances, IsRefusedToThoseWhoAreNotRoot) {
  EXPECT_THAT(in_a_child([] {
                if (::setresuid(65534, 65534, 65534) != 0) return std::string("no other user");
                return become("64043");
              }),
              HasSubstr("takes root with CAP_SETUID and CAP_SETGID"));
}

}  // namespace
}  // namespace plchost
