#include "manager/supervisor/process_host.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/files/lock_file.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pages/log_ring.hpp"
#include "shm/process/dynamic_loader.hpp"
#include "tests/support/group_folder.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

/// A host whose instance is a shell script.
class ProcessHostTest : public ::testing::Test, public InstanceEvents {
 protected:
  ProcessHostTest() {
    std::filesystem::create_directory(folder_);
    sut_.connect_events(*this);
  }
  ~ProcessHostTest() override {
    LogRing::remove(pool_, "line1");
    std::filesystem::remove_all(folder_);
  }
  void on_report(const SetupReport& /*report*/) override {}
  void on_reply(const ControlReply& /*reply*/) override {}
  void on_timer() override {}
  void on_application_checked(const Result<void>& result) override {
    refusal_ = result ? "" : result.error().message;
    reactor_->stop();
  }
  void on_exit(const ExitStatus& status) override {
    end_ = status;
    said_ = sut_.last_line();
    reactor_->stop();
  }
  void write_program(const std::string& script) const {
    const std::string program = folder_ / "plc-instance";
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  }
  void run(const std::string& script) {
    write_program(script);
    const auto pid = sut_.spawn({});
    ASSERT_TRUE(pid) << pid.error().describe();
    ASSERT_TRUE(reactor_->run());
  }

  /// The script that plays the instance, in the group that it is told.
  void run_in_group(const std::string& script) { run(kEnterGroup + script); }
  /// The same of a trial of an application.
  void run_trial(const std::string& script) {
    write_program(kEnterGroup + script);
    ASSERT_TRUE(sut_.check_application({}));
    ASSERT_TRUE(reactor_->run());
  }

  const std::string kEnterGroup =
      "while [ \"$1\" != --control-group ]; do shift; done\necho 0 >\"$2/cgroup.procs\"\n";

  GroupFolder folder_of_groups_;
  ControlGroups groups_ = ControlGroups::find(folder_of_groups_.path());
  std::string pool_ = own_name("host");
  std::filesystem::path folder_ = std::filesystem::temp_directory_path() / own_name("host");
  std::unique_ptr<Reactor> reactor_ = std::move(*Reactor::create());
  ProcessHost sut_{*reactor_,
                   {.program = folder_ / "plc-instance",
                    .name = "line1",
                    .pool = pool_,
                    .run_directory = folder_,
                    .withdraw_events = [this] { events_withdrawn_ = !end_.exited_with(3); },
                    .groups = &groups_,
                    .share = [] { return ProcessHost::Share{.limits = {}, .oom_score = 300}; },
                    .trial_group = TrialGroup(groups_, trial_group_name(pool_, "line1"),
                                              [this] { return limits_of_trial_; })}};
  GroupLimits limits_of_trial_;
  ExitStatus end_;
  bool events_withdrawn_ = false;  // before anybody was told of the end
  std::string said_;
  std::string refusal_;  // of an application; empty: it is valid
};

TEST_F(ProcessHostTest, KnowsTheLastLineOfAProcessWhenItHasEnded) {
  run("echo first; printf 'x: error while loading shared libraries: y: Error 24' >&2; exit 127");
  EXPECT_TRUE(end_.exited_with(kExitNotLoaded));
  EXPECT_EQ(said_, "x: error while loading shared libraries: y: Error 24");
}

// The loader begins with the path of the program, and ends with the cause.
TEST_F(ProcessHostTest, KnowsTheEndOfALongLastLine) {
  run("printf '/%0600d: error while loading shared libraries: y: Error 24' 0 >&2; exit 127");
  EXPECT_EQ(said_.size(), InstanceOutput::kLastLine);
  EXPECT_TRUE(said_.ends_with("00: error while loading shared libraries: y: Error 24")) << said_;
}

TEST_F(ProcessHostTest, WithdrawsTheEventsBeforeItTellsOfTheEnd) {
  run("exit 3");
  EXPECT_TRUE(events_withdrawn_);
}

TEST_F(ProcessHostTest, TakesNoLineOfAnEarlierProcess) {
  run("echo first");
  EXPECT_EQ(said_, "first");
  run("exit 127");
  EXPECT_EQ(said_, "");
}

class ProcessHostWithGroups : public ProcessHostTest {
 protected:
  void SetUp() override {
    if (!folder_of_groups_.there()) GTEST_SKIP() << kNoGroupFolder;
  }
  void expect_holder_runs_on(const std::string& claim);
};

TEST_F(ProcessHostWithGroups, EndsWhatAProcessHasLeftInItsGroup) {
  const std::string group = control_group_name(pool_, "line1");
  const std::string left = folder_ / "left";
  run_in_group("setsid sh -c 'echo >" + left + "; exec sleep 1000' >/dev/null 2>&1 &\nwhile [ ! -e " + left +
               " ]; do sleep 0.01; done");
  EXPECT_TRUE(end_.success()) << end_.describe();
  EXPECT_TRUE(folder_of_groups_.comes_to(group, 0));
}

TEST_F(ProcessHostWithGroups, TriesApplicationsInAGroupOfTheirOwn) {
  const std::string group = trial_group_name(pool_, "line1");
  const std::string left = folder_ / "left";
  run_trial("cat /proc/self/cgroup\nsetsid sh -c 'echo >" + left +
            "; exec sleep 1000' >/dev/null 2>&1 &\nwhile [ ! -e " + left + " ]; do sleep 0.01; done\nexit 3");
  EXPECT_TRUE(refusal_.contains("/" + group)) << refusal_;
  for (int i = 0; i < 1000 && !groups_.remove_ended(); ++i) ::usleep(10'000);
  EXPECT_FALSE(folder_of_groups_.has(group)) << "nor the process that it has left";
}

TEST_F(ProcessHostWithGroups, TriesApplicationsWithTheLimitsOfTheInstance) {
  const std::string group = folder_of_groups_.path() + "/" + trial_group_name(pool_, "line1");
  limits_of_trial_ = {.memory_bytes = 64U << 20, .pids = 16};
  run_trial("cat \"$2/memory.max\" \"$2/pids.max\"\nexit 3");
  if (refusal_.contains("No such file"))
    GTEST_SKIP() << "needs the controllers of memory and pids in version 2";
  EXPECT_TRUE(refusal_.contains("67108864; 17")) << refusal_;
  limits_of_trial_ = {.memory_bytes = 64U << 20, .pids = 2};
  run_trial("sleep 1000 & sleep 1000 & sleep 1000 & sleep 1000 & wait\nexit 3");
  EXPECT_TRUE(refusal_.contains("; it needs more threads and processes than pids_max of its instance"))
      << refusal_;
  limits_of_trial_ = {.memory_bytes = 8U << 20, .pids = 0};
  run_trial("exec tail /dev/zero");
  EXPECT_EQ(refusal_,
            "the process that tried it has ended: killed by SIGKILL; it needs more memory than "
            "memory_max_mib of its instance");
}

void ProcessHostWithGroups::expect_holder_runs_on(const std::string& claim) {
  const std::string group = control_group_name(pool_, "line1");
  ASSERT_TRUE(groups_.make(group, {}));
  const pid_t holder = ::fork();
  if (holder == 0) {
    std::ofstream(folder_of_groups_.path() + "/" + group + "/cgroup.procs") << 0;
    const auto lock = LockFile::take(claim);
    if (lock) std::ofstream(folder_ / "held") << 1;
    for (;;) ::pause();
  }
  for (int i = 0; i < 1000 && !std::filesystem::exists(folder_ / "held"); ++i) ::usleep(10'000);
  const std::string taken =
      encode(SetupReport{SetupStep::attach_pool, ErrorCode::already_exists, "x", false});
  run_in_group("printf '%s' '" + taken + "' >&3\nexit 3");
  EXPECT_TRUE(end_.exited_with(3));
  pid_t ended = 0;
  for (int i = 0; i < 30 && ended == 0; ++i) {
    ::usleep(10'000);
    ended = ::waitpid(holder, nullptr, WNOHANG);
  }
  EXPECT_EQ(ended, 0) << "it runs on";
  ::kill(holder, SIGKILL);
  ::waitpid(holder, nullptr, 0);
  run_in_group("exit 0");
  for (int i = 0; i < 1000 && !groups_.remove_ended(); ++i) ::usleep(10'000);
  EXPECT_FALSE(folder_of_groups_.has(group));
}

// Else the process that has the name, and drives machines, would be ended with the one that is too many.
TEST_F(ProcessHostWithGroups, EndsNobodyInTheGroupOfAProcessThatHasTheName) {
  expect_holder_runs_on(folder_ / "line1.claim");
}

TEST_F(ProcessHostWithGroups, EndsNobodyWhoHasTheNameByAnotherRunDirectory) {
  const std::string claim = MemoryFile::path(instance_claim_name(pool_, "line1"));
  expect_holder_runs_on(claim);
  ::unlink(claim.c_str());
}

TEST_F(ProcessHostTest, TellsAProcessItsOomScoreAndWithoutGroupsNoGroup) {
  groups_ = ControlGroups::find("/no/such/folder");
  run("echo \"$@\"");
  EXPECT_TRUE(said_.contains(" --oom-score 300 ")) << said_;
  EXPECT_FALSE(said_.contains("--control-group")) << said_;
}

}  // namespace
}  // namespace plchost
