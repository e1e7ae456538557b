// The filter of system calls around an application, from its constructors to its cycles.
#include <cerrno>
#include <csignal>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/instances/instance_process.hpp"
#include "tests/support/sanitized.hpp"

namespace plchost::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class SandboxedInstance : public ::testing::Test {
 protected:
  [[nodiscard]] std::vector<std::string> with(const std::string& seccomp, const std::string& program) const {
    const std::string settings = seccomp.empty() ? "" : fmt::format("[Sandbox]\nSeccomp={}\n", seccomp);
    return {"--settings", sandbox.write("line1.cfg", settings), "--application", application(program)};
  }
  Sandbox sandbox;
};

/// A line of /proc/PID/status.
std::string status_of(pid_t pid, std::string_view key) {
  std::ifstream file(fmt::format("/proc/{}/status", pid));
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(key)) return line;
  }
  return "";
}

/// Without the part about the program that it cannot start.
class SandboxOfSockets : public SandboxedInstance {
 protected:
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "with a sanitizer its application becomes a shell";
  }
  static bool has_said(const InstanceProcess& sut, int of_cycle) {
    return eventually([&] {
      return sut.log().contains(fmt::format("program {}\n", EPERM)) &&
             sut.log().contains("socket in the set-up 0\n") && sut.log().contains("own socket 0\n") &&
             sut.log().contains(fmt::format("socket in a cycle {}\n", of_cycle)) &&
             sut.log().contains(fmt::format("socket of a thread {}\n", of_cycle));
    });
  }
};

TEST_F(SandboxOfSockets, IsOpenByDefaultAndStartsNoProgram) {
  InstanceProcess sut(sandbox, with("", "confined"));
  sut.wait_until_up();
  EXPECT_TRUE(has_said(sut, 0)) << sut.log();
  EXPECT_THAT(sut.log(), AllOf(HasSubstr("seccomp: no programs"), Not(HasSubstr("no new sockets"))));
  EXPECT_EQ(status_of(sut.pid(), "NoNewPrivs:"), "NoNewPrivs:\t1");
  EXPECT_EQ(sut.end(SIGTERM), 0);
}

TEST_F(SandboxOfSockets, IsClosedWhenTheApplicationStarts) {
  InstanceProcess sut(sandbox, with("NoSockets", "confined"));
  sut.wait_until_up();
  EXPECT_TRUE(has_said(sut, EPERM)) << sut.log();
  EXPECT_THAT(sut.log(), AllOf(HasSubstr("seccomp: no programs"), HasSubstr("seccomp: no new sockets")));
  EXPECT_EQ(sut.end(SIGTERM), 0);
}

TEST_F(SandboxOfSockets, HoldsInATrial) {
  InstanceProcess sut(sandbox, {"--check-application", application("confined")});
  EXPECT_EQ(sut.end(), 0) << sut.log();
  EXPECT_THAT(sut.log(), AllOf(HasSubstr("is a valid application"), Not(HasSubstr("seccomp"))));
}

TEST_F(SandboxedInstance, MayBeLeftOut) {
  InstanceProcess sut(sandbox, with("Off", "confined"));
  EXPECT_EQ(sut.end(), 7) << "the shell's";
}

// Its sockets were made before, and it accepts on them.
TEST_F(SandboxedInstance, WithoutNewSocketsObeysCommandsAndTakesAnotherVersion) {
  InstanceProcess sut(sandbox, with("NoSockets", "online_1"));
  sut.wait_until_up();
  EXPECT_EQ(sut.ask(ControlVerb::change_application, application("online_2")).code, ErrorCode::ok);
  EXPECT_EQ(sut.ask(ControlVerb::stop).code, ErrorCode::ok);
  EXPECT_EQ(sut.ask(ControlVerb::start).code, ErrorCode::ok);
  EXPECT_EQ(sut.ask(ControlVerb::status).code, ErrorCode::ok);
  EXPECT_EQ(sut.end(SIGTERM), 0);
}

}  // namespace
}  // namespace plchost::testing
