// Applications that cannot run: refused with a text that says why, by --check-application and at start alike.
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>

#include "shm/threads/thread.hpp"
#include "tests/integration/instances/instance_process.hpp"

namespace plchost::testing {
namespace {

using ::testing::HasSubstr;

using ::testing::Not;

// Processes that have this in their environment, but not this one.
std::vector<std::string> processes_with(const std::string& mark) {
  std::vector<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ostringstream environment;
    environment << std::ifstream(entry.path() / "environ", std::ios::binary).rdbuf();
    if (environment.str().contains(mark)) found.push_back(entry.path().filename());
  }
  return found;
}

struct CrashingProgram {
  const char* application;
  const char* text;
};

class ApplicationWith : public ::testing::TestWithParam<CrashingProgram> {};

TEST_P(ApplicationWith, IsRefusedByTheCheck) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--check-application", application(GetParam().application)});
  EXPECT_EQ(sut.end(), 3);
  EXPECT_THAT(sut.log(), HasSubstr(GetParam().text));
}

TEST_P(ApplicationWith, IsRefusedAtStart) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--application", application(GetParam().application)});
  EXPECT_EQ(sut.end(), 3);
  EXPECT_THAT(sut.log(), HasSubstr("load application failed"));
  EXPECT_THAT(sut.log(), HasSubstr(GetParam().text));
}

INSTANTIATE_TEST_SUITE_P(
    Faults, ApplicationWith,
    ::testing::Values(
        CrashingProgram{"fault_init_fails", "plc_app_init returned 7"},
        CrashingProgram{"fault_throws", "plc_app_init threw: no valve is connected"},
        CrashingProgram{"fault_no_tasks", "did not call __sys__setup__tasks"},
        CrashingProgram{"fault_two_setups", "called __sys__setup__tasks more than once"},
        CrashingProgram{"fault_bad_interval", "task 'Only': dwInterval must be above 0"},
        CrashingProgram{"fault_wrong_version", "built against version 42 of plc_app.h"},
        CrashingProgram{"fault_missing_init", "does not export plc_app_init"},
        CrashingProgram{"fault_undefined_symbol", "function_of_another_runtime"},
        CrashingProgram{"fault_undefined_method", "undefined symbol: other::method_of_another_library(int)"},
        CrashingProgram{"fault_empty_cycle", "task 'Fill': its cycle is an empty function"},
        CrashingProgram{"fault_empty_variable", "task 'Cap': its event variable is an empty function"},
        CrashingProgram{"fault_two_areas", "area 'level' is refused: it is there already"},
        CrashingProgram{"fault_empty_setup", "the setup function makes no task"}),
    [](const auto& test) { return std::string(test.param.application); });

TEST(ApplicationExit, ThatThrowsDoesNotKeepTheProcessFromItsOrderlyEnd) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--application", application("fault_exit_throws")});
  sut.wait_until_up();
  EXPECT_EQ(sut.end(SIGTERM), EXIT_SUCCESS);
  EXPECT_THAT(sut.log(), HasSubstr("plc_app_exit threw: the valve does not close"));
  EXPECT_THAT(sut.log(), HasSubstr("ended"));
}

TEST(ApplicationExit, ThatCrashesLeavesNoPageBehind) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--application", application("fault_exit_aborts")});
  sut.wait_until_up();
  ASSERT_TRUE(InstancePageReader::open(sandbox.pool(), "line1"));
  EXPECT_EQ(sut.end(SIGTERM), -SIGABRT);
  EXPECT_FALSE(InstancePageReader::open(sandbox.pool(), "line1"));
  EXPECT_FALSE(TransitionRingReader::open(sandbox.pool(), "line1"));
}

struct EndingProgram {
  const char* application;
  const char* text;
};

// Applications that do not return from their set-up, or not as they should.
class TrialOf : public ::testing::TestWithParam<EndingProgram> {};

TEST_P(TrialOf, SaysHowTheSetUpEnded) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--check-application", application(GetParam().application)});
  EXPECT_EQ(sut.end(), 3);
  EXPECT_THAT(sut.log(), HasSubstr(GetParam().text));
  EXPECT_THAT(sut.log(), Not(HasSubstr("is a valid application")));
}

INSTANTIATE_TEST_SUITE_P(
    Ends, TrialOf,
    ::testing::Values(
        EndingProgram{"fault_exits", "it ends its process in its set-up (exit code 0)"},
        EndingProgram{"fault_exits_refused", "it ends its process in its set-up (exit code 3)"},
        EndingProgram{"fault_kills_group", "its set-up was ended by SIGKILL"},
        EndingProgram{"fault_closes", "it closes descriptors in its set-up that it has not opened"},
        EndingProgram{"fault_loops", "took longer than 10 s: does it return from its set-up?"},
        EndingProgram{"fault_crashes", "it crashes in its set-up: SIGSEGV in open_valve(int volatile*)"},
        EndingProgram{"fault_overflows", "it crashes in its set-up: SIGSEGV in deeper(int)"}),
    [](const auto& test) { return std::string(test.param.application); });

class SignalEndsATrial : public ::testing::TestWithParam<int> {};

TEST_P(SignalEndsATrial, WhoseSetUpDoesNotReturn) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--check-application", application("fault_loops")});
  const std::string children = fmt::format("/proc/{0}/task/{0}/children", sut.pid());
  pid_t child = 0;
  ASSERT_TRUE(eventually([&] { return static_cast<bool>(std::ifstream(children) >> child); }));
  EXPECT_EQ(sut.end(GetParam()), -GetParam());
  EXPECT_EQ(::kill(child, 0), -1) << "the process that tries it is still there";
}

INSTANTIATE_TEST_SUITE_P(Signals, SignalEndsATrial, ::testing::Values(SIGINT, SIGTERM));

// It may run on the core of an instance.
TEST(ApplicationCheck, HasNoRealTimeThread) {
  if (!Thread::start("probe", {.fifo = 1}, [] {})) GTEST_SKIP() << "no right to SCHED_FIFO";
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--check-application", application("fault_loops")});
  const std::string children = fmt::format("/proc/{0}/task/{0}/children", sut.pid());
  pid_t child = 0;
  ASSERT_TRUE(eventually([&] { return static_cast<bool>(std::ifstream(children) >> child); }));
  const auto has_watch = [&] {
    bool watch = false;
    std::error_code error;
    for (const auto& task : std::filesystem::directory_iterator(fmt::format("/proc/{}/task", child), error)) {
      std::string name;
      std::getline(std::ifstream(task.path() / "comm") >> std::ws, name);
      watch = watch || name == "set-up watch";
      const pid_t thread = std::stoi(task.path().filename());
      EXPECT_EQ(::sched_getscheduler(thread), SCHED_OTHER) << name;
    }
    return watch;
  };
  EXPECT_TRUE(eventually(has_watch));
  EXPECT_EQ(sut.end(SIGTERM), -SIGTERM);
}

TEST(ApplicationCheck, EndsWhatTheApplicationHasForked) {
  const Sandbox sandbox;
  const std::string mark = fmt::format("PLCHOST_TRIAL_OF={}", sandbox.pool());
  InstanceProcess sut(sandbox, {"--check-application", application("fault_forks")}, {mark});
  EXPECT_EQ(sut.end(), 0);
  EXPECT_THAT(processes_with(mark), ::testing::IsEmpty());
}

TEST(ApplicationCheck, ListsTheTasksOfAValidApplication) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--check-application", application("all_kinds")});
  EXPECT_EQ(sut.end(), 0);
  EXPECT_THAT(sut.log(), HasSubstr("AllKinds, 8 tasks"));
  EXPECT_THAT(sut.log(), HasSubstr("Fast: cyclic, priority 1, every 2000 us"));
}

TEST(ApplicationCheck, FindsEveryFunctionThatTheRuntimeOffers) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--check-application", application("every_call")});
  EXPECT_EQ(sut.end(), 0) << sut.log();
  EXPECT_THAT(sut.log(), HasSubstr("EveryCall, 1 task"));
}

TEST(ApplicationCheck, RefusesATextFileAndAFolder) {
  const Sandbox sandbox;
  InstanceProcess text(sandbox, {"--check-application", sandbox.write("mine.so", "int main() {}\n")});
  EXPECT_EQ(text.end(), 3);
  EXPECT_THAT(text.log(), HasSubstr("is not a shared object"));
  InstanceProcess folder(sandbox, {"--check-application", sandbox.folder()});
  EXPECT_EQ(folder.end(), 3);
  EXPECT_THAT(folder.log(), HasSubstr("is not a file"));
}

TEST(ApplicationCheck, RefusesAnEmptyNameInsteadOfStartingAnInstance) {
  const Sandbox sandbox;
  for (const std::string option : {"--check-application", "--check-settings"}) {
    InstanceProcess sut(sandbox, {option, ""});
    EXPECT_EQ(sut.end(), 2);
    EXPECT_THAT(sut.log(), HasSubstr("the name of the file is empty"));
  }
}

TEST(ApplicationCheck, TellsNoControlCharactersOfAFile) {
  const Sandbox sandbox;
  std::ostringstream whole;
  whole << std::ifstream(application("fault_undefined_symbol"), std::ios::binary).rdbuf();
  std::string changed = whole.str();
  const std::string symbol = "function_of_another_runtime";
  for (std::size_t at = changed.find(symbol); at != std::string::npos; at = changed.find(symbol, at + 1)) {
    changed[at + 2] = '\x1b';
    changed[at + 3] = '\xff';
  }
  InstanceProcess sut(sandbox, {"--check-application", sandbox.write("mine.so", changed)});
  EXPECT_EQ(sut.end(), 3);
  EXPECT_THAT(sut.log(), HasSubstr("fu??tion_of_another_runtime"));
}

TEST(ApplicationCheck, RefusesACopyThatWasCutShort) {
  const Sandbox sandbox;
  std::ostringstream whole;
  whole << std::ifstream(application("packer"), std::ios::binary).rdbuf();
  const std::string cut = sandbox.write("packer.so", whole.str().substr(0, whole.str().size() * 3 / 4));
  InstanceProcess sut(sandbox, {"--check-application", cut});
  EXPECT_EQ(sut.end(), 3);
  EXPECT_THAT(sut.log(), HasSubstr("is cut short or damaged"));
}

}  // namespace
}  // namespace plchost::testing
