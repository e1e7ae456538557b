// Each set-up step's own error, as a person reads it and as the manager gets it.
#include <array>
#include <csignal>
#include <fstream>
#include <optional>

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "instances/launch/launch_contract.hpp"
#include "tests/integration/instances/instance_process.hpp"
#include "tests/support/held_pool_lock.hpp"
#include "tests/support/own_name.hpp"
#include "tests/support/receive_until.hpp"

namespace plchost::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

struct Case {
  const char* name;
  std::vector<std::string> arguments;
  int exit_code;
  std::string text;
};

class SetupOf : public ::testing::TestWithParam<Case> {};

TEST_P(SetupOf, FailsWithItsStepAndReason) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, GetParam().arguments);
  EXPECT_EQ(sut.end(), GetParam().exit_code);
  EXPECT_THAT(sut.log(), HasSubstr(GetParam().text));
}

INSTANTIATE_TEST_SUITE_P(
    Steps, SetupOf,
    ::testing::Values(
        Case{"UnknownOption", {"--shceduler", "x"}, 2, "--shceduler"},
        Case{"UnknownScheduler", {"--scheduler", "CmpShedule"}, 2, "CmpScheduleOneShot"},
        Case{"UnknownBand", {"--priority-band", "higher"}, 2, "high, normal, low"},
        Case{"BadName", {"--name", "a b"}, 2, "instance name"},
        Case{"BadLogLevel", {"--log-level", "loud"}, 2, "trace, debug"},
        Case{"CoreThatIsNotThere", {"--core", "1000"}, 3, "bind core failed"},
        Case{"MissingSettings", {"--settings", "/nonexistent.cfg"}, 3, "read settings failed: settings file"},
        Case{"RunDirectoryThatIsNotThere",
             {"--run-directory", "/nonexistent"},
             3,
             "cannot claim the instance's name in the run directory: cannot open /nonexistent/"},
        Case{"MissingApplication",
             {"--application", "/nonexistent.so"},
             3,
             "load application failed: /nonexistent.so cannot be opened"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(Setup, RefusesAnUnknownKeyWithFileLineAndSuggestion) {
  const Sandbox sandbox;
  const std::string file = sandbox.write("line1.cfg", "[CmpSchedule]\n\nSchedulerIntervall=1000\n");
  InstanceProcess sut(sandbox, {"--settings", file});
  EXPECT_EQ(sut.end(), 3);
  EXPECT_THAT(sut.log(), HasSubstr(file + ":3: "));
  EXPECT_THAT(sut.log(), HasSubstr("did you mean 'SchedulerInterval'?"));
}

TEST(Setup, RefusesSomethingInThePlaceOfThePool) {
  const Sandbox sandbox;
  const std::string none = own_name("none");
  const std::string broken = own_name("broken");
  InstanceProcess sut(sandbox, {"--pool", none, "--stopped"});
  const std::string file = "/dev/shm/" + broken;
  std::ofstream(file) << std::string(100'000, 'x');
  InstanceProcess refused(sandbox, {"--name", "line2", "--pool", broken});
  EXPECT_EQ(refused.end(), 3);
  EXPECT_THAT(refused.log(), HasSubstr("attach pool failed"));
  ObjectPool::remove(broken);
  EXPECT_EQ(sut.connect() ? sut.end(SIGTERM) : -1, 0);
  ObjectPool::remove(none);
}

TEST(Setup, RefusesAComponentThatIsNone) {
  const Sandbox sandbox;
  (void)sandbox.write("driver.so", "not a program");
  const std::string file = sandbox.write("line1.cfg", "[ComponentManager]\nComponent.1=driver.so\n");
  InstanceProcess sut(sandbox, {"--settings", file});
  EXPECT_EQ(sut.end(), 3);
  EXPECT_THAT(sut.log(), HasSubstr("load components failed: component: " + sandbox.folder() + "/driver.so"));
}

/// An application whose plc_app_init returns 0, and which is refused then.
struct Refused {
  const char* by;
  const char* application;
  const char* settings;
  const char* reason;
};

class RefusedFirstLoad : public ::testing::TestWithParam<Refused> {};

TEST_P(RefusedFirstLoad, CallsItsExitOnceWhenTheReasonIsTold) {
  const Sandbox sandbox;
  const std::string file = sandbox.write("line1.cfg", GetParam().settings);
  InstanceProcess sut(sandbox, {"--settings", file, "--application", application(GetParam().application)});
  EXPECT_EQ(sut.end(), 3);
  const std::string log = sut.log();
  const std::size_t reason = log.find(GetParam().reason);
  const std::size_t exit = log.find("exit of version 1, online 0");
  ASSERT_NE(reason, std::string::npos) << log;
  ASSERT_NE(exit, std::string::npos) << log;
  EXPECT_LT(reason, exit);
  EXPECT_EQ(log.find("exit of version", exit + 1), std::string::npos) << log;
}

INSTANTIATE_TEST_SUITE_P(
    Each, RefusedFirstLoad,
    ::testing::Values(Refused{"ItsTasks", "online_options", "", "no task 'Nobody'"},
                      Refused{"SettingsOfItsTasks", "online_1", "[Task.Nobody]\nLatePolicy=Next\n", "Nobody"},
                      Refused{"ItsAreas", "online_1",
                              "[SysMem]\nLinux.Area.0.Flags=0x10\nLinux.Area.0.Device=/"
                              "nonexistent\nLinux.Area.0.Address=0\nLinux.Area.0.Size=8\n",
                              "/nonexistent"}),
    [](const auto& test) { return std::string(test.param.by); });

// The reports as the manager reads them.
std::vector<SetupReport> reports_of(const Sandbox& sandbox, const std::string& program) {
  std::array<int, 2> ends{};
  EXPECT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends.data()), 0);
  ::fcntl(ends[0], F_SETFD, FD_CLOEXEC);
  InstanceProcess sut(sandbox, {"--report-fd", std::to_string(ends[1]), "--application", program});
  ::close(ends[1]);
  PacketSocket socket{UniqueFd(ends[0])};
  std::vector<SetupReport> reports;
  while (true) {
    const auto packet = receive_until(socket, MonotonicClock::now() + 20s);
    const auto report =
        packet ? decode_report(*packet) : Result<SetupReport>(std::unexpected(packet.error()));
    if (!report) break;
    reports.push_back(*report);
    if (report->step == SetupStep::ready) break;
  }
  return reports;
}

TEST(SetupReports, NameEachStepInOrderAndEndWithReady) {
  const Sandbox sandbox;
  const auto reports = reports_of(sandbox, application("all_kinds"));
  ASSERT_EQ(reports.size(), static_cast<std::size_t>(SetupStep::ready) + 1);
  for (std::size_t i = 0; i < reports.size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(reports[i].step), i);
    EXPECT_EQ(reports[i].code, ErrorCode::ok);
  }
}

TEST(SetupReports, EndWithTheStepThatFailed) {
  const Sandbox sandbox;
  const auto reports = reports_of(sandbox, "/nonexistent.so");
  ASSERT_FALSE(reports.empty());
  EXPECT_EQ(reports.back().step, SetupStep::load_application);
  EXPECT_EQ(reports.back().code, ErrorCode::not_found);
  EXPECT_THAT(reports.back().text, HasSubstr("/nonexistent.so"));
}

// An instance that went on would leave the events of the process before as they are, and their posters would
// be told that tasks run what they post.
TEST(SetupReports, OfAStartBesideALockedPoolSayThatItMayBeRepeated) {
  const Sandbox sandbox;
  const ObjectPool pool = ObjectPool::create(sandbox.pool()).value();
  std::optional<HeldPoolLock> held(sandbox.pool());
  const auto reports = reports_of(sandbox, application("all_kinds"));
  held.reset();
  ASSERT_FALSE(reports.empty());
  EXPECT_EQ(reports.back().step, SetupStep::attach_pool) << to_string(reports.back().step);
  EXPECT_EQ(reports.back().code, ErrorCode::timed_out);
  EXPECT_TRUE(reports.back().transient);
  EXPECT_THAT(reports.back().text, HasSubstr("holds its lock"));
}

/// The last report of a process that may have so many descriptors, and whether it goes on when it is up.
struct Scarce {
  SetupReport last;
  bool up = false;
  bool goes_on = false;
};

Scarce start_with_descriptors(const Sandbox& sandbox, rlim_t descriptors, const std::string& program) {
  constexpr int kReports = 3;
  std::array<int, 2> ends{};
  EXPECT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()), 0);
  const std::string log = sandbox.folder() + "/scarce.log";
  const pid_t child = ::fork();
  if (child == 0) {
    const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    ::dup2(file, STDOUT_FILENO);
    ::dup2(file, STDERR_FILENO);
    ::dup2(ends[1], kReports);
    ::close_range(kReports + 1, ~0U, 0);
    const rlimit limit{.rlim_cur = descriptors, .rlim_max = descriptors};
    ::setrlimit(RLIMIT_NOFILE, &limit);
    ::execl(PLC_INSTANCE, PLC_INSTANCE, "--name", "line1", "--pool", sandbox.pool().c_str(),
            "--run-directory", sandbox.folder().c_str(), "--report-fd", "3", "--application", program.c_str(),
            nullptr);
    ::_exit(126);
  }
  ::close(ends[1]);
  PacketSocket socket{UniqueFd(ends[0])};
  Scarce seen;
  while (!seen.up) {
    const auto packet = receive_until(socket, MonotonicClock::now() + 60s);
    const auto report =
        packet ? decode_report(*packet) : Result<SetupReport>(std::unexpected(packet.error()));
    if (!report) break;
    seen.last = *report;
    seen.up = report->step == SetupStep::ready;
  }
  const auto heartbeat = [&] {
    const auto page = InstancePageReader::open(sandbox.pool(), "line1");
    const auto runtime = page ? page->runtime() : std::nullopt;
    return runtime ? runtime->heartbeat_ns : 0;
  };
  int status = 0;
  bool ended = false;
  const std::int64_t first = heartbeat();
  seen.goes_on = seen.up && eventually([&] {
                   ended = ::waitpid(child, &status, WNOHANG) == child;
                   return ended || heartbeat() != first;
                 }) &&
                 !ended;
  if (!ended) {
    ::kill(child, SIGKILL);
    ::waitpid(child, &status, 0);
  }
  return seen;
}

// The manager tries those starts again: none of them is the fault of the files, and none is a crash.
TEST(SetupReports, OfAStartWithTooFewDescriptorsSayThatItMayBeRepeated) {
  const Sandbox sandbox;
  constexpr rlim_t kFewest = 5;  // one more than the program is begun with
  constexpr rlim_t kEnough = 128;
  for (rlim_t descriptors = kFewest; descriptors < kEnough; ++descriptors) {
    const Scarce seen = start_with_descriptors(sandbox, descriptors, application("all_kinds"));
    SCOPED_TRACE(
        fmt::format("{} descriptors: {}: {}", descriptors, to_string(seen.last.step), seen.last.text));
    if (!seen.up) {
      ASSERT_NE(seen.last.code, ErrorCode::ok);
      ASSERT_TRUE(seen.last.transient);
    } else {
      ASSERT_TRUE(seen.goes_on);
      return;
    }
  }
  FAIL() << "it never came up";
}

}  // namespace
}  // namespace plchost::testing
