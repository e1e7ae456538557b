// The two stages of the filter of an instance: the calls that fail from each on, and those that go on.
#include "instances/runtime/setup/sandbox.hpp"

#include <array>
#include <csignal>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/process/capabilities.hpp"
#include "tests/support/in_a_child.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

/// The remark of a stage; an error begins with "error: ".
std::string remark_of(const Result<Confinement>& stage) {
  return stage ? stage->remark : "error: " + stage.error().describe();
}

std::string confine(Seccomp wanted) {
  if (!refuse_new_rights()) return "no_new_privs is not set";
  return remark_of(confine_to_load(wanted));
}

/// Those that do not fail as they should, by name. The arguments are nonsense, so that no call does any harm.
std::string allowed_of(std::span<const RefusedCall> calls) {
  std::string allowed;
  for (const RefusedCall& call : calls) {
    errno = 0;
    const long first = call.flags == 0 ? -1 : static_cast<long>(call.flags);
    const long result = ::syscall(call.number, first, -1, -1, -1, -1, -1);
    if (result != -1 || errno != call.error) allowed += fmt::format("{} ", call.name);
  }
  return allowed;
}

TEST(Sandbox, OfTheFirstStageRefusesEachCallOfItsTable) {
  EXPECT_EQ(in_a_child([] {
              const std::string wrong = confine(Seccomp::no_exec);
              return wrong + allowed_of(calls_refused_to_load());
            }),
            "");
}

TEST(Sandbox, OfTheSecondStageRefusesNewSocketsToo) {
  const auto both_stages = [](Seccomp wanted) {
    return in_a_child([=] {
      const std::string first = confine(wanted);
      const int made = ::socket(AF_UNIX, SOCK_STREAM, 0);
      const std::string second = remark_of(confine_to_start(wanted));
      return first + second + fmt::format("{} {}", made >= 0, allowed_of(calls_refused_to_start()));
    });
  };
  EXPECT_EQ(both_stages(Seccomp::no_sockets), "true ");
  EXPECT_EQ(both_stages(Seccomp::no_exec), "true socket socketpair ");
}

// By clone() instead of clone3().
TEST(Sandbox, LeavesThreadsAndChildren) {
  EXPECT_EQ(in_a_child([] {
              const std::string wrong = confine(Seccomp::no_sockets);
              int of_thread = 0;
              std::thread([&] { of_thread = 1; }).join();
              const pid_t child = ::fork();
              if (child == 0) ::_exit(2);
              int status = 0;
              ::waitpid(child, &status, 0);
              return fmt::format("{}{} {}", wrong, of_thread, WEXITSTATUS(status));
            }),
            "1 2");
}

TEST(Sandbox, IsOffIfTheSettingsSaySo) {
  EXPECT_EQ(in_a_child([] {
              const std::string wrong = confine(Seccomp::off) + remark_of(confine_to_start(Seccomp::off));
              std::ifstream status("/proc/self/status");
              for (std::string line; std::getline(status, line);) {
                if (line.starts_with("Seccomp:")) return wrong + line;
              }
              return wrong;
            }),
            "Seccomp:\t0");
}

// A kernel without filters, and a container that keeps them to itself.
TEST(Sandbox, KeepsNoInstanceFromItsStartUnlessItIsAskedFor) {
  const auto without_filters = [](Seccomp wanted, int error = EINVAL) {
    return in_a_child([=] {
      const std::array none = {RefusedCall{SYS_seccomp, "seccomp", 0, error}};
      if (!refuse_new_rights() || !refuse_system_calls(none)) return std::string("no filter at all");
      return confine(wanted);
    });
  };
  constexpr auto kReason = "cannot set a filter of system calls (seccomp): Invalid argument (EINVAL)";
  EXPECT_EQ(without_filters(Seccomp::no_exec), kReason);
  EXPECT_EQ(without_filters(Seccomp::no_sockets), fmt::format("error: [Sandbox] Seccomp: {}", kReason));
  EXPECT_EQ(without_filters(Seccomp::off), "");
  EXPECT_THAT(without_filters(Seccomp::no_exec, ENOMEM), StartsWith("error: ")) << "the start is repeated";
}

TEST(Sandbox, IsDescribedCallByCall) {
  std::stringstream page;
  page << std::ifstream(INSTANCES_SETTINGS).rdbuf();
  for (const auto calls : {calls_refused_to_load(), calls_refused_to_start()}) {
    for (const RefusedCall& call : calls) {
      EXPECT_THAT(page.str(), HasSubstr(fmt::format("`{}`", call.name))) << INSTANCES_SETTINGS;
    }
  }
}

}  // namespace
}  // namespace plchost
