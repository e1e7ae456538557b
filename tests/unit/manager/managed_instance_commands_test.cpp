#include <csignal>

#include "tests/unit/manager/managed_instance_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

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
  ask(ControlVerb::start);
  report_ready();
  take_reply();
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
  EXPECT_EQ(reply.text, "task Main does not return; its next process begins stopped");
  EXPECT_EQ(state(), InstanceState::running);
}

// An operator who tried to stop a machine and ends its process does not want it to start again.
TEST_F(ManagedInstanceTest, ComesUpStoppedAfterAStopThatFailedUntilItIsStarted) {
  bring_up();
  ask(ControlVerb::stop);
  answer(ErrorCode::timed_out, "task Main does not return");
  take_reply();
  sut().on_exit(killed_by(SIGKILL));
  expire_timer();
  EXPECT_TRUE(host_.spawned.back().stopped);
}

TEST_F(ManagedInstanceTest, TellsThatAStopHoldsWhichDidNotReachItsProcess) {
  bring_up();
  host_.can_send = false;
  ask(ControlVerb::stop);
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::unavailable);
  EXPECT_THAT(reply.text, HasSubstr("nobody listens; its next process begins stopped"));
  sut().on_exit(killed_by(SIGKILL));
  expire_timer();
  EXPECT_TRUE(host_.spawned.back().stopped);
}

TEST_F(ManagedInstanceTest, RunsAgainAfterAStopThatFailedAndAStart) {
  bring_up();
  ask(ControlVerb::stop);
  answer(ErrorCode::timed_out, "task Main does not return");
  take_reply();
  ask(ControlVerb::start);
  EXPECT_EQ(take_reply().text, "'line1' is running already");
  sut().on_exit(killed_by(SIGKILL));
  expire_timer();
  EXPECT_FALSE(host_.spawned.back().stopped);
}

TEST_F(ManagedInstanceTest, PassesTheResetOfStatisticsOnAndNeedsAProcessForIt) {
  ask(ControlVerb::reset_statistics, "Main");
  EXPECT_EQ(take_reply().code, ErrorCode::wrong_state);
  bring_up();
  ask(ControlVerb::reset_statistics, "no/name");
  EXPECT_EQ(take_reply().code, ErrorCode::invalid_argument);
  for (const char* task : {"Main", ""}) {
    ask(ControlVerb::reset_statistics, task);
    EXPECT_EQ(host_.requests.back().verb, ControlVerb::reset_statistics);
    EXPECT_EQ(host_.requests.back().argument, task);
    answer();
    EXPECT_EQ(take_reply().code, ErrorCode::ok);
  }
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

TEST_F(ManagedInstanceTest, RestartOfAStoppedOneThatOutlastsItsClientStartsNothing) {
  bring_up_stopped();
  ask_until(1, ControlVerb::restart);  // that is long ago when the process has ended
  sut().on_exit(killed_by(SIGKILL));
  EXPECT_EQ(take_reply().code, ErrorCode::timed_out);
  EXPECT_TRUE(host_.spawned.back().stopped);
  report_ready();
  EXPECT_EQ(state(), InstanceState::stopped);
}

TEST_F(ManagedInstanceTest, RestartOfARunningOneThatOutlastsItsClientRunsAgain) {
  bring_up();
  ask_until(1, ControlVerb::restart);
  sut().on_exit(killed_by(SIGKILL));
  report_ready();
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(ManagedInstanceTest, StopThatIsNotDoneForItsLimitLeavesTheWishBefore) {
  sut().hold("is to be started");
  sut().release();
  ask_until(1, ControlVerb::stop);  // long ago when the process is up
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::timed_out);
  EXPECT_EQ(state(), InstanceState::running);
  ASSERT_TRUE(wishes_.wish);
  EXPECT_TRUE(wishes_.wish->running);
  EXPECT_FALSE(wishes_.wish->commanded);
  crash_once();
  EXPECT_FALSE(host_.spawned.back().stopped) << "its client was told that the stop is not done";
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(ManagedInstanceTest, StopThatWaitsHoldsForTheProcessThatFollowsOneThatCrashes) {
  sut().hold("is to be started");
  sut().release();
  ask_until(1, ControlVerb::stop);
  sut().on_exit(killed_by(SIGSEGV));
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::offline);
}

TEST_F(ManagedInstanceTest, TellsHowManyForcesHaveEndedWithTheProcess) {
  const auto force = [this](std::uint32_t count) {
    host_.page.emplace();
    host_.page->pid = sut().status().pid;
    host_.page->forces = count;
  };
  const auto renew = [this](ControlVerb verb) {
    ask(verb);
    host_.page.reset();  // it takes its page away
    sut().on_exit(exited_with(0));
    report_ready();
    return take_reply().text;
  };
  bring_up();
  force(2);
  EXPECT_EQ(renew(ControlVerb::restart), "line1: restarted; 2 forces ended");
  EXPECT_EQ(renew(ControlVerb::restart), "") << "none was forced";
  force(1);
  EXPECT_EQ(renew(ControlVerb::reset), "line1: reset, and stopped; 1 force ended");
  force(0);
  EXPECT_EQ(renew(ControlVerb::reset_cold), "");
}

TEST_F(ManagedInstanceTest, TellsHowManyForcesHaveEndedWithACommandThatFailed) {
  bring_up();
  host_.page.emplace();
  host_.page->pid = sut().status().pid;
  host_.page->forces = 3;
  ask(ControlVerb::restart);
  sut().on_exit(exited_with(0));
  sut().on_exit(exited_with(kExitSetupFailed));
  EXPECT_THAT(take_reply().text, testing::EndsWith("; 3 forces ended"));
}

TEST_F(ManagedInstanceTest, ACrashTellsHowManyForcesHaveEnded) {
  bring_up();
  host_.page.emplace();
  host_.page->pid = sut().status().pid;
  host_.page->forces = 2;
  sut().on_exit(killed_by(SIGSEGV));
  EXPECT_THAT(problem(), HasSubstr("; 2 forces ended"));
  expire_timer();
  report_ready();
  EXPECT_THAT(problem(), HasSubstr("; 2 forces ended"));
  ask(ControlVerb::restart);
  sut().on_exit(exited_with(0));
  report_ready();
  EXPECT_EQ(take_reply().text, "") << "they have ended before";
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

}  // namespace
}  // namespace plchost
