#include "manager/supervisor/managed_instance.hpp"

#include <csignal>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>

#include "tests/unit/manager/fake_host.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

class ManagedInstanceTest : public testing::Test {
 protected:
  ManagedInstanceTest() {
    config_.name = "line1";
    config_.core = 1;
    config_.application = "/opt/line.so";
    config_.crash_limit = 3;
    config_.crash_window = seconds(10);
    host_config_.pool = "pool";
    host_config_.run_directory = "/run/x";
    make();
  }

  void make() {
    sut_.emplace(config_,
                 ManagedInstance::Surroundings{.host = host_config_,
                                               .folder = "/etc/plchost",
                                               .schedulers = {"CmpSchedule", "CmpScheduleTimer"},
                                               .now = [this] { return now_; },
                                               .changed = [this] { ++changes_; }},
                 host_);
  }

  ManagedInstance& sut() { return *sut_; }
  InstanceState state() { return sut().status().state; }
  std::string problem() { return std::string(sut().status().problem.view()); }
  void advance(Duration duration) { now_ += duration; }
  void expire_timer() {
    ASSERT_TRUE(host_.timer.has_value());
    now_ = std::max(now_, *host_.timer);
    host_.timer.reset();
    sut().on_timer();
  }
  void report_ready() { sut().on_report({.step = SetupStep::ready, .code = ErrorCode::ok, .text = ""}); }
  void bring_up() {
    sut().hold("is to be started");
    sut().release();
    report_ready();
    ASSERT_EQ(state(), InstanceState::running);
  }
  void bring_up_stopped() {
    ask(ControlVerb::reset);
    report_ready();
    take_reply();
    ASSERT_EQ(state(), InstanceState::stopped);
  }
  void ask(ControlVerb verb, const std::string& argument = "") {
    sut().handle({.number = 7, .verb = verb, .instance = "line1", .argument = argument},
                 [this](const ControlReply& reply) { replies_.push_back(reply); });
  }
  /// The one reply that came; there must be one.
  ControlReply take_reply() {
    EXPECT_EQ(replies_.size(), 1U);
    if (replies_.empty()) return {.number = 0, .code = ErrorCode::system, .text = "no reply came"};
    ControlReply reply = replies_.back();
    replies_.clear();
    return reply;
  }
  void answer(ErrorCode code = ErrorCode::ok, const std::string& text = "") {
    ASSERT_FALSE(host_.requests.empty());
    sut().on_reply({.number = host_.requests.back().number, .code = code, .text = text});
  }
  void crash_once() {
    sut().on_exit(killed_by(SIGSEGV));
    ASSERT_EQ(state(), InstanceState::waiting);
    expire_timer();
    report_ready();
  }
  void reach_safe_mode() {
    bring_up();
    for (int i = 0; i < 3; ++i) crash_once();
    ASSERT_EQ(state(), InstanceState::safe_mode);
  }

  InstanceConfig config_;
  HostConfig host_config_;
  FakeHost host_;
  TimePoint now_{seconds(1000)};
  int changes_ = 0;
  std::vector<ControlReply> replies_;
  std::optional<ManagedInstance> sut_;
};

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
  EXPECT_EQ(problem(), "killed by SIGKILL: was not ready after 30 s");
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
        PolicyCase{"never_exit_0", RestartPolicy::never, exited_with(0), InstanceState::offline},
        PolicyCase{"failure_crash", RestartPolicy::on_failure, killed_by(SIGSEGV), InstanceState::waiting},
        PolicyCase{"failure_exit_1", RestartPolicy::on_failure, exited_with(1), InstanceState::waiting},
        PolicyCase{"failure_exit_0", RestartPolicy::on_failure, exited_with(0), InstanceState::offline},
        PolicyCase{"failure_unknown", RestartPolicy::on_failure, ExitStatus{.known = false},
                   InstanceState::waiting},
        PolicyCase{"always_crash", RestartPolicy::always, killed_by(SIGKILL), InstanceState::waiting},
        PolicyCase{"always_exit_0", RestartPolicy::always, exited_with(0), InstanceState::waiting}),
    [](const auto& test) { return test.param.name; });

TEST_F(ManagedInstanceTest, ComesBackAfterTheDelayAndCountsIt) {
  bring_up();
  sut().on_exit(killed_by(SIGKILL));
  EXPECT_EQ(problem(), "killed by SIGKILL; starts again 100 ms later");
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

// --- commands

TEST_F(ManagedInstanceTest, StopsAndStartsTheApplicationInItsProcess) {
  bring_up();
  ask(ControlVerb::stop);
  EXPECT_TRUE(replies_.empty());
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::stop);
  answer();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::stopped);
  ask(ControlVerb::start);
  answer();
  EXPECT_EQ(take_reply().number, 7U);
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(host_.spawned.size(), 1U);
}

TEST_F(ManagedInstanceTest, AnswersAtOnceWhenThereIsNothingToDo) {
  ask(ControlVerb::stop);
  EXPECT_EQ(take_reply().text, "'line1' has no process: nothing to stop");
  bring_up();
  ask(ControlVerb::start);
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::ok);
  EXPECT_EQ(reply.text, "'line1' is running already");
  EXPECT_TRUE(host_.requests.empty());
}

TEST_F(ManagedInstanceTest, PassesOnWhatTheInstanceRefuses) {
  bring_up();
  ask(ControlVerb::stop);
  answer(ErrorCode::timed_out, "task Main does not return");
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::timed_out);
  EXPECT_EQ(reply.text, "task Main does not return");
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(ManagedInstanceTest, StartSpawnsAProcessAndAnswersWhenItIsUp) {
  ask(ControlVerb::start);
  EXPECT_EQ(state(), InstanceState::starting);
  EXPECT_TRUE(replies_.empty());
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(ManagedInstanceTest, StartOverridesWhatItWaitsFor) {
  sut().hold("waits for 'drive1'");
  ask(ControlVerb::start);
  EXPECT_EQ(state(), InstanceState::starting);
}

TEST_F(ManagedInstanceTest, StopCancelsAPendingRestart) {
  bring_up();
  sut().on_exit(killed_by(SIGSEGV));
  ask(ControlVerb::stop);
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::offline);
  EXPECT_FALSE(host_.timer.has_value());
}

TEST_F(ManagedInstanceTest, StopOfAStartingInstanceStopsItWhenItIsUp) {
  sut().hold("");
  sut().release();
  ask(ControlVerb::stop);
  EXPECT_TRUE(host_.requests.empty());
  report_ready();
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::stop);
  answer();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::stopped);
}

TEST_F(ManagedInstanceTest, StopOfAStartingInstanceThatEndsCancelsItsRestart) {
  sut().hold("");
  sut().release();
  ask(ControlVerb::stop);
  sut().on_exit(killed_by(SIGSEGV));
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::offline);
}

TEST_F(ManagedInstanceTest, ResetMakesAFreshStoppedProcess) {
  bring_up();
  ask(ControlVerb::reset);
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::shutdown);
  EXPECT_EQ(state(), InstanceState::stopping);
  sut().on_exit(exited_with(0));
  ASSERT_EQ(host_.spawned.size(), 2U);
  EXPECT_TRUE(host_.spawned.back().stopped);
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::stopped);
  EXPECT_EQ(sut().status().restarts, 0U);
}

TEST_F(ManagedInstanceTest, RestartEndsAStubbornProcessByForce) {
  bring_up();
  ask(ControlVerb::restart);
  expire_timer();
  expire_timer();
  EXPECT_THAT(host_.signals, testing::ElementsAre(SIGTERM, SIGKILL));
  sut().on_exit(killed_by(SIGKILL));
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(ManagedInstanceTest, AnswersWhenTheFreshProcessDoesNotComeUp) {
  bring_up();
  ask(ControlVerb::restart);
  sut().on_exit(exited_with(0));
  sut().on_report({.step = SetupStep::make_tasks, .code = ErrorCode::invalid_argument, .text = "bad"});
  sut().on_exit(exited_with(kExitSetupFailed));
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::unavailable);
  EXPECT_EQ(reply.text, "the process of 'line1' ended: exit code 3: make tasks: bad");
  EXPECT_EQ(state(), InstanceState::failed);
}

TEST_F(ManagedInstanceTest, IsBusyWhileOneCommandIsCarriedOut) {
  bring_up();
  ask(ControlVerb::stop);
  ask(ControlVerb::restart);
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::busy);
  EXPECT_EQ(reply.text, "instance 'line1' is busy with 'stop'; try again when it is done");
}

TEST_F(ManagedInstanceTest, AnswersWhenTheProcessEndsInstead) {
  bring_up();
  ask(ControlVerb::stop);
  sut().on_exit(killed_by(SIGSEGV));
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::unavailable);
  EXPECT_THAT(reply.text, HasSubstr("killed by SIGSEGV"));
  expire_timer();
  EXPECT_TRUE(host_.spawned.back().stopped);  // as was wished
}

TEST_F(ManagedInstanceTest, AnswersWhenTheInstanceDoesNot) {
  bring_up();
  ask(ControlVerb::stop);
  const auto late = host_.requests.back().number;
  expire_timer();
  EXPECT_EQ(take_reply().code, ErrorCode::timed_out);
  sut().on_reply({.number = late, .code = ErrorCode::ok, .text = ""});
  EXPECT_TRUE(replies_.empty());
}

// --- loading

TEST_F(ManagedInstanceTest, RefusesAWrongApplicationAndLeavesTheRunningOneAlone) {
  bring_up();
  ask(ControlVerb::load_application, "new.so");
  EXPECT_THAT(host_.checked, testing::ElementsAre("/etc/plchost/new.so"));
  sut().on_application_checked(failure(ErrorCode::invalid_argument, "not an ELF file"));
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::invalid_argument);
  EXPECT_EQ(reply.text, "/etc/plchost/new.so is refused: not an ELF file");
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_TRUE(host_.requests.empty());
  EXPECT_EQ(sut().status().application.view(), "/opt/line.so");
}

TEST_F(ManagedInstanceTest, RunsTheNewApplicationIfTheOldOneRan) {
  bring_up();
  ask(ControlVerb::load_application, "/opt/new.so");
  sut().on_application_checked({});
  sut().on_exit(exited_with(0));
  EXPECT_EQ(host_.spawned.back().application, "/opt/new.so");
  EXPECT_FALSE(host_.spawned.back().stopped);
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
}

TEST_F(ManagedInstanceTest, LoadsStoppedIfItWasStopped) {
  bring_up_stopped();
  ask(ControlVerb::load_application, "/opt/new.so");
  sut().on_application_checked({});
  sut().on_exit(exited_with(0));
  EXPECT_TRUE(host_.spawned.back().stopped);
}

TEST_F(ManagedInstanceTest, LoadLeavesSafeMode) {
  reach_safe_mode();
  ask(ControlVerb::start);
  EXPECT_EQ(take_reply().code, ErrorCode::wrong_state);
  ask(ControlVerb::load_application, "/opt/new.so");
  sut().on_application_checked({});
  sut().on_exit(exited_with(0));
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(problem(), "");
}

TEST_F(ManagedInstanceTest, RemembersAnApplicationForOneThatIsOffline) {
  ask(ControlVerb::load_application, "/opt/new.so");
  sut().on_application_checked({});
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::offline);
  EXPECT_EQ(sut().status().application.view(), "/opt/new.so");
}

TEST_F(ManagedInstanceTest, SurvivesACrashWhileAnApplicationIsChecked) {
  bring_up();
  ask(ControlVerb::load_application, "/opt/new.so");
  sut().on_exit(killed_by(SIGSEGV));
  EXPECT_TRUE(replies_.empty());
  sut().on_application_checked({});
  EXPECT_EQ(host_.spawned.back().application, "/opt/new.so");
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
}

// --- scheduler and events

TEST_F(ManagedInstanceTest, RemembersAnAcceptedSchedulerForTheNextProcess) {
  bring_up();
  ask(ControlVerb::set_scheduler, "CmpScheduleTimer");
  answer();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(sut().status().scheduler.view(), "CmpScheduleTimer");
  crash_once();
  EXPECT_EQ(host_.spawned.back().scheduler, "CmpScheduleTimer");
}

TEST_F(ManagedInstanceTest, RemembersTheSchedulerOfOneWithoutProcess) {
  ask(ControlVerb::set_scheduler, "CmpScheduleTimer");
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  bring_up();
  EXPECT_EQ(host_.spawned.back().scheduler, "CmpScheduleTimer");
}

TEST_F(ManagedInstanceTest, ForwardsRegistrations) {
  ask(ControlVerb::register_event, "ready");
  EXPECT_EQ(take_reply().code, ErrorCode::wrong_state);
  bring_up();
  ask(ControlVerb::register_event, "ready");
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::register_event);
  EXPECT_EQ(host_.requests.back().argument, "ready");
  answer();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::running);
}

struct WrongArgument {
  const char* name;
  ControlVerb verb;
  std::string argument;
  ErrorCode code;
  const char* text;
};
class CommandRefuses : public ManagedInstanceTest, public testing::WithParamInterface<WrongArgument> {};
TEST_P(CommandRefuses, SayingWhatIsAllowed) {
  bring_up();
  ask(GetParam().verb, GetParam().argument);
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, GetParam().code);
  EXPECT_THAT(reply.text, HasSubstr(GetParam().text));
  EXPECT_TRUE(host_.requests.empty());
}
INSTANTIATE_TEST_SUITE_P(
    All, CommandRefuses,
    testing::Values(
        WrongArgument{"scheduler", ControlVerb::set_scheduler, "CmpShedule", ErrorCode::invalid_argument,
                      "no scheduler 'CmpShedule'; there are CmpSchedule, CmpScheduleTimer; did you mean "
                      "'CmpSchedule'?"},
        WrongArgument{"event", ControlVerb::register_event, "a b", ErrorCode::invalid_argument,
                      "event 'a b' is not valid"},
        WrongArgument{"event_long", ControlVerb::unregister_event, std::string(51, 'e'),
                      ErrorCode::invalid_argument, "1 to 50"},
        WrongArgument{"path", ControlVerb::load_application, "", ErrorCode::invalid_argument,
                      "needs the path"},
        WrongArgument{"path_long", ControlVerb::load_application, "/" + std::string(255, 'x'),
                      ErrorCode::invalid_argument, "path of 256 characters; allowed are up to 255"},
        WrongArgument{"status", ControlVerb::status, "", ErrorCode::unsupported,
                      "between the manager and an instance"},
        WrongArgument{"shutdown", ControlVerb::shutdown, "", ErrorCode::unsupported, "between the manager"}),
    [](const auto& test) { return test.param.name; });

// --- adoption

InstanceRuntime page_of(int pid, bool running, std::string_view scheduler, std::string_view application) {
  InstanceRuntime runtime;
  runtime.pid = pid;
  runtime.running = running ? 1 : 0;
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
  EXPECT_EQ(problem(), "ended (status unknown: it was adopted); starts again 100 ms later");
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

// --- what the process says of itself, and the end

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

TEST_F(ManagedInstanceTest, BreaksOffWhatGoesOnWhenTheManagerEnds) {
  bring_up();
  ask(ControlVerb::stop);
  sut().shut_down();
  EXPECT_EQ(take_reply().text, "the manager is shutting down");
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::shutdown);
  ask(ControlVerb::start);
  EXPECT_EQ(take_reply().code, ErrorCode::unavailable);
  sut().on_exit(killed_by(SIGKILL));
  EXPECT_EQ(state(), InstanceState::offline);
  EXPECT_FALSE(host_.timer.has_value());
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
