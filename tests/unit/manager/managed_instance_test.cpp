#include <csignal>
#include <utility>

#include "tests/unit/manager/managed_instance_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

// --- setting up

TEST_F(ManagedInstanceTest, SpawnsWithWhatTheConfigurationSays) {
  config_.scheduler = "CmpScheduleTimer";
  config_.priority_band = "high";
  config_.settings = "/etc/line.cfg";
  make();
  bring_up();
  ASSERT_EQ(host_.spawned.size(), 1U);
  const LaunchOptions& options = host_.spawned[0];
  EXPECT_EQ(options.name, "line1");
  EXPECT_EQ(options.cores, std::vector<int>{1});
  EXPECT_EQ(options.scheduler, "CmpScheduleTimer");
  EXPECT_EQ(options.priority_band, "high");
  EXPECT_EQ(options.settings, "/etc/line.cfg");
  EXPECT_EQ(options.application, "/opt/line.so");
  EXPECT_EQ(options.pool, "pool");
  EXPECT_EQ(options.run_directory, "/run/x");
  EXPECT_FALSE(options.stopped);
  EXPECT_EQ(sut().status().pid, 100);
  EXPECT_EQ(sut().status().core, 1);
  EXPECT_EQ(problem(), "");
}

TEST_F(ManagedInstanceTest, TellsItsPlanAlsoWhenThatChanges) {
  config_.settings = "/etc/line.cfg";
  config_.after = {"line0", "axis.1"};
  config_.restart = RestartPolicy::always;
  make();
  EXPECT_EQ(sut().status().plan.settings.view(), "/etc/line.cfg") << "before it was ever started";
  EXPECT_EQ(sut().status().plan.after.view(), "line0,axis.1");
  EXPECT_EQ(sut().status().plan.restart, RestartPolicy::always);
  EXPECT_EQ(sut().status().plan.application.view(), "/opt/line.so");
  EXPECT_EQ(sut().status().plan.crash_limit, 3U);
  EXPECT_EQ(sut().status().plan.crash_window_ns, 10'000'000'000);
  EXPECT_EQ(sut().status().plan.restart_delay_ns, 100'000'000);
  config_.restart = RestartPolicy::never;
  config_.after.clear();
  bring_up();
  EXPECT_EQ(sut().status().plan.restart, RestartPolicy::always);
  sut().reconfigure(config_);
  EXPECT_EQ(sut().status().plan.restart, RestartPolicy::never);
  EXPECT_EQ(sut().status().plan.after.view(), "");
}

TEST_F(ManagedInstanceTest, SaysWhatFailedInTheSetUpAndDoesNotTryAgain) {
  sut().hold("");
  sut().release();
  sut().on_report({.step = SetupStep::load_application, .code = ErrorCode::not_found, .text = "no file x"});
  sut().on_exit(exited_with(kExitSetupFailed));
  EXPECT_EQ(state(), InstanceState::failed);
  EXPECT_EQ(problem(), "exit code 3: load application: no file x");
  EXPECT_FALSE(host_.timer.has_value());
  EXPECT_EQ(sut().status().pid, 0);
}

TEST_F(ManagedInstanceTest, TriesAFailedSetUpAgainWhenItIsToRunAlways) {
  config_.restart = RestartPolicy::always;
  make();
  sut().hold("");
  sut().release();
  sut().on_exit(exited_with(kExitSetupFailed));
  EXPECT_EQ(state(), InstanceState::waiting);
  expire_timer();
  EXPECT_EQ(host_.spawned.size(), 2U);
}

TEST_F(ManagedInstanceTest, KillsAProcessThatIsNotReadyInTime) {
  sut().hold("");
  sut().release();
  expire_timer();
  EXPECT_THAT(host_.signals, testing::ElementsAre(SIGKILL));
  sut().on_exit(killed_by(SIGKILL));
  EXPECT_EQ(state(), InstanceState::failed);
  EXPECT_EQ(problem(), "killed by SIGKILL: was not ready after 30 s: its step 'bind core' has not ended");
}

TEST_F(ManagedInstanceTest, SaysWhyAProcessCouldNotBeStarted) {
  host_.can_spawn = false;
  ask(ControlVerb::start);
  EXPECT_EQ(state(), InstanceState::failed);
  EXPECT_EQ(take_reply().code, ErrorCode::unavailable);
}

TEST_F(ManagedInstanceTest, SaysWhenTheKernelGrantedOtherCores) {
  host_.cores = {0, 1};
  bring_up();
  EXPECT_EQ(sut().status().core, -1);
  EXPECT_THAT(problem(), HasSubstr("may run on cores 0, 1 where 1 is configured"));
}

// --- restart policy

struct PolicyCase {
  const char* name;
  RestartPolicy policy;
  ExitStatus exit;
  InstanceState expected;
};
class RestartPolicyTest : public ManagedInstanceTest, public testing::WithParamInterface<PolicyCase> {};

TEST_P(RestartPolicyTest, DecidesWhatFollowsAnEnd) {
  config_.restart = GetParam().policy;
  make();
  bring_up();
  sut().on_exit(GetParam().exit);
  EXPECT_EQ(state(), GetParam().expected);
  EXPECT_THAT(problem(), testing::StartsWith(GetParam().exit.describe()));
}
INSTANTIATE_TEST_SUITE_P(
    All, RestartPolicyTest,
    testing::Values(
        PolicyCase{"never_crash", RestartPolicy::never, killed_by(SIGSEGV), InstanceState::failed},
        PolicyCase{"never_exit_0", RestartPolicy::never, exited_with(0), InstanceState::failed},
        PolicyCase{"failure_crash", RestartPolicy::on_failure, killed_by(SIGSEGV), InstanceState::waiting},
        PolicyCase{"failure_exit_1", RestartPolicy::on_failure, exited_with(1), InstanceState::waiting},
        PolicyCase{"failure_exit_0", RestartPolicy::on_failure, exited_with(0), InstanceState::waiting},
        PolicyCase{"failure_unknown", RestartPolicy::on_failure, ExitStatus{.known = false},
                   InstanceState::waiting},
        PolicyCase{"always_crash", RestartPolicy::always, killed_by(SIGKILL), InstanceState::waiting},
        PolicyCase{"always_exit_0", RestartPolicy::always, exited_with(0), InstanceState::waiting}),
    [](const auto& test) { return test.param.name; });

TEST_F(ManagedInstanceTest, SaysThatNobodyAskedForAnExitWithoutError) {
  bring_up();
  sut().on_exit(exited_with(0));
  EXPECT_EQ(problem(),
            "exit code 0, which nobody asked for; crash 1 of 3 within 10 s; starts again 100 ms later");
  expire_timer();
  EXPECT_EQ(host_.spawned.back().start_kind, StartKind::after_fault);
}

TEST_F(ManagedInstanceTest, ComesBackAfterTheDelayAndCountsIt) {
  bring_up();
  sut().on_exit(killed_by(SIGKILL));
  EXPECT_EQ(problem(), "killed by SIGKILL; crash 1 of 3 within 10 s; starts again 100 ms later");
  EXPECT_EQ(*host_.timer - now_, milliseconds(100));
  EXPECT_EQ(sut().status().restarts, 0U);
  expire_timer();
  EXPECT_EQ(state(), InstanceState::starting);
  report_ready();
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(sut().status().restarts, 1U);
  EXPECT_EQ(problem(), "ended last: killed by SIGKILL");
}

TEST_F(ManagedInstanceTest, DoublesTheDelayUpToItsMaximum) {
  config_.restart_delay_max = milliseconds(350);
  config_.crash_limit = 100;
  make();
  bring_up();
  for (const auto expected : {100, 200, 350, 350}) {
    sut().on_exit(killed_by(SIGSEGV));
    EXPECT_EQ(*host_.timer - now_, milliseconds(expected));
    expire_timer();
    report_ready();
  }
}

TEST_F(ManagedInstanceTest, ForgetsTheDelayOfOneThatStayedUpForAWindow) {
  bring_up();
  crash_once();
  advance(config_.crash_window);
  sut().on_exit(killed_by(SIGSEGV));
  EXPECT_EQ(*host_.timer - now_, milliseconds(100));
}

TEST_F(ManagedInstanceTest, GoesToSafeModeAtTheCrashLimit) {
  bring_up();
  crash_once();
  crash_once();
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(host_.spawned.back().application, "/opt/line.so");
  crash_once();
  EXPECT_EQ(state(), InstanceState::safe_mode);
  EXPECT_EQ(host_.spawned.back().application, "");
  EXPECT_THAT(problem(), HasSubstr("safe mode after 3 crashes within 10 s, the last: killed by SIGSEGV"));
  EXPECT_FALSE(sut().ready());
}

TEST_F(ManagedInstanceTest, CountsOnlyCrashesWithinTheWindow) {
  bring_up();
  for (int i = 0; i < 6; ++i) {
    crash_once();
    advance(seconds(6));
  }
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(ManagedInstanceTest, StaysStoppedAfterACrashIfItWasStopped) {
  bring_up_stopped();
  sut().on_exit(killed_by(SIGKILL));
  expire_timer();
  EXPECT_TRUE(host_.spawned.back().stopped);
  report_ready();
  EXPECT_EQ(state(), InstanceState::stopped);
}

// --- adoption

InstanceRuntime page_of(int pid, bool running, std::string_view scheduler, std::string_view application) {
  InstanceRuntime runtime;
  runtime.pid = pid;
  runtime.running = running ? 1 : 0;
  runtime.state = running ? ApplicationState::running : ApplicationState::stopped;
  runtime.scheduler.assign(scheduler);
  runtime.application.assign(application);
  return runtime;
}

TEST_F(ManagedInstanceTest, AdoptsAProcessAsItIs) {
  host_.adoptable = 55;
  host_.page = page_of(55, true, "CmpScheduleTimer", "/opt/other.so");
  ASSERT_TRUE(sut().adopt());
  EXPECT_EQ(state(), InstanceState::starting);
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::status);
  answer();
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(sut().status().pid, 55);
  EXPECT_EQ(sut().status().scheduler.view(), "CmpScheduleTimer");
  EXPECT_EQ(sut().status().application.view(), "/opt/other.so");
  EXPECT_EQ(problem(), "");
  EXPECT_TRUE(host_.spawned.empty());
  sut().on_exit({.known = false});
  EXPECT_EQ(problem(),
            "ended (status unknown: it was adopted); crash 1 of 3 within 10 s; starts again 100 ms later");
}

TEST_F(ManagedInstanceTest, LeavesAnAdoptedProcessThatDoesNotAnswerAlive) {
  host_.adoptable = 55;
  host_.page = page_of(55, true, "CmpSchedule", "/opt/line.so");
  ASSERT_TRUE(sut().adopt());
  expire_timer();
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_THAT(problem(), HasSubstr("does not answer on its control socket"));
  EXPECT_TRUE(host_.signals.empty());
}

TEST_F(ManagedInstanceTest, AdoptsWhoTookTheNameMeanwhile) {
  sut().hold("");
  sut().release();
  sut().on_report(
      {.step = SetupStep::attach_pool, .code = ErrorCode::already_exists, .text = "process 55 has it"});
  sut().on_exit(exited_with(kExitSetupFailed));
  EXPECT_EQ(state(), InstanceState::waiting);
  host_.adoptable = 55;
  host_.page = page_of(55, true, "CmpSchedule", "/opt/line.so");
  expire_timer();
  answer();
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(sut().status().pid, 55);
  EXPECT_EQ(host_.spawned.size(), 1U);
}

TEST_F(ManagedInstanceTest, AdoptsSafeModeAsSafeMode) {
  host_.adoptable = 55;
  host_.page = page_of(55, false, "CmpSchedule", "");
  ASSERT_TRUE(sut().adopt());
  answer();
  EXPECT_EQ(state(), InstanceState::safe_mode);
}

TEST_F(ManagedInstanceTest, HasNothingToAdoptIfNobodyAnswers) {
  EXPECT_FALSE(sut().adopt());
}

// --- the process's report of itself, and the end

TEST_F(ManagedInstanceTest, SeesThatTheApplicationStoppedByItself) {
  bring_up();
  host_.page = page_of(100, false, "CmpSchedule", "/opt/line.so");
  sut().refresh();
  EXPECT_EQ(state(), InstanceState::running);  // the page may be older than the answer
  advance(kPageLag);
  sut().refresh();
  EXPECT_EQ(state(), InstanceState::stopped);
  EXPECT_THAT(problem(), HasSubstr("stopped by itself"));
  host_.page = page_of(100, true, "CmpSchedule", "/opt/line.so");
  sut().refresh();
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(ManagedInstanceTest, LeavesTheChoiceOfTheSchedulerToTheSettingsOfEachProcess) {
  bring_up();
  EXPECT_EQ(host_.spawned.back().scheduler, "");
  host_.page = page_of(100, true, "CmpScheduleOneShot", "/opt/line.so");
  advance(kPageLag);
  sut().refresh();
  EXPECT_EQ(sut().status().scheduler.view(), "CmpScheduleOneShot");
  crash_once();
  EXPECT_EQ(host_.spawned.back().scheduler, "") << "its settings may say something else by now";
}

TEST_F(ManagedInstanceTest, RemembersASchedulerThatTheProcessWasSwitchedToByOthers) {
  bring_up();
  host_.page = page_of(100, true, "CmpSchedule", "/opt/line.so");
  advance(kPageLag);
  sut().refresh();
  host_.page = page_of(100, true, "CmpScheduleTimer", "/opt/line.so");
  sut().refresh();
  crash_once();
  EXPECT_EQ(host_.spawned.back().scheduler, "CmpScheduleTimer");
}

TEST_F(ManagedInstanceTest, BreaksOffWhatGoesOnWhenTheManagerEnds) {
  bring_up();
  ask(ControlVerb::stop);
  sut().shut_down();
  EXPECT_EQ(take_reply().text, "the manager is shutting down; its next process begins stopped");
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::shutdown);
  ask(ControlVerb::start);
  EXPECT_EQ(take_reply().code, ErrorCode::unavailable);
  sut().on_exit(killed_by(SIGKILL));
  EXPECT_EQ(state(), InstanceState::offline);
  EXPECT_FALSE(host_.timer.has_value());
}

TEST_F(ManagedInstanceTest, TellsAStepThatNoTableHasAndTakesItAllTheSame) {
  sut().hold("is to be started");
  host_.adoptable = 77;
  ASSERT_TRUE(sut().adopt());
  EXPECT_EQ(state(), InstanceState::starting);
  EXPECT_THAT(std::exchange(observer_.wrong, {}), testing::ElementsAre("'held' does not lead to 'adopting'"));
}

TEST_F(ManagedInstanceTest, TerminatesAProcessThatHasNoControlSocketYet) {
  sut().hold("");
  sut().release();
  host_.can_send = false;
  sut().shut_down();
  EXPECT_THAT(host_.signals, testing::ElementsAre(SIGTERM));
  sut().on_exit(killed_by(SIGTERM));
  EXPECT_EQ(state(), InstanceState::offline);
}

}  // namespace
}  // namespace plchost
