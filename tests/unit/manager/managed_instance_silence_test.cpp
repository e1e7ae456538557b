// A process whose control thread beats no more: its state, and the effect of each command.
#include <algorithm>
#include <csignal>
#include <utility>

#include "tests/unit/manager/managed_instance_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

TEST(HeartbeatWatch, IsSilentWhenTheBeatStandsStillForTheLimit) {
  HeartbeatWatch sut;
  TimePoint now{seconds(100)};
  const TimePoint begin = now;
  for (sut.look(now, 7); !sut.silent(); sut.look(now, 7)) now += milliseconds(50);
  EXPECT_EQ(now - begin, HeartbeatWatch::kLimit);
  sut.look(now + milliseconds(50), 8);
  EXPECT_FALSE(sut.silent());
}

TEST(HeartbeatWatch, DoesNotCountWhatTheManagerSlept) {
  HeartbeatWatch sut;
  sut.look(TimePoint{seconds(100)}, 7);
  sut.look(TimePoint{seconds(1000)}, 7);
  EXPECT_FALSE(sut.silent());
}

TEST(HeartbeatWatch, DoesNotCountWhatOtherProgramsTook) {
  HeartbeatWatch sut;
  TimePoint now{seconds(100)};
  for (int i = 0; i < 1000; ++i) sut.look(now += milliseconds(50), 7, true);
  EXPECT_FALSE(sut.silent());
  while (!sut.silent()) sut.look(now += milliseconds(50), 7);
  EXPECT_EQ(now, TimePoint{seconds(100)} + milliseconds(50) * 1000 + HeartbeatWatch::kLimit);
}

class AStarvation : public testing::Test {
 protected:
  void look_for(Duration duration, Duration process_takes = {}, Duration thread_takes = {}) {
    for (Duration passed{}; passed < duration; passed += milliseconds(50)) {
      use.used += process_takes;
      for (auto& thread : use.ready) thread.used += thread_takes;
      (void)sut.look(now += milliseconds(50), use);
    }
  }
  StarvationWatch sut;
  TimePoint now{seconds(100)};
  ProcessorUse use;
};

TEST_F(AStarvation, IsOfAThreadThatIsReadyAndGetsNothing) {
  use.ready = {{.id = 5, .used = {}}};
  look_for(seconds(3));
  EXPECT_EQ(sut.lasted(), seconds(3) - milliseconds(50))
      << "nothing is known of the time before the first look";
  use.ready.clear();
  look_for(seconds(3));
  EXPECT_EQ(sut.lasted(), seconds(3) - milliseconds(50));
  sut.forget();
  EXPECT_EQ(sut.lasted(), Duration::zero());
}

TEST_F(AStarvation, IsNoneOfAThreadThatRuns) {
  use.ready = {{.id = 5, .used = {}}};
  look_for(seconds(3), milliseconds(20), milliseconds(20));
  EXPECT_EQ(sut.lasted(), Duration::zero());
}

TEST_F(AStarvation, IsNoneByTheProcessItself) {
  use.ready = {{.id = 5, .used = {}}};
  look_for(seconds(3), milliseconds(45));
  EXPECT_EQ(sut.lasted(), Duration::zero());
  look_for(seconds(3), milliseconds(30));
  EXPECT_EQ(sut.lasted(), seconds(3)) << "it takes the rest";
}

TEST_F(AStarvation, IsNoneOfThreadsThatAreReadyInTurn) {
  for (pid_t i = 0; i < 60; ++i) {
    use.ready = {{.id = 5 + i % 2, .used = {}}};
    look_for(milliseconds(50));
  }
  EXPECT_EQ(sut.lasted(), Duration::zero());
}

class SilentProcess : public ManagedInstanceTest {
 protected:
  void beat() {
    InstanceRuntime runtime;
    runtime.pid = sut().status().pid;
    runtime.state = ApplicationState::running;
    runtime.scheduler.assign("CmpSchedule");
    runtime.application.assign(config_.application);
    runtime.heartbeat_ns = now_.time_since_epoch().count();
    host_.page = runtime;
    sut().refresh();
  }
  void fall_silent() {
    for (Duration passed{}; passed <= HeartbeatWatch::kLimit; passed += milliseconds(50)) {
      sut().refresh();
      advance(milliseconds(50));
    }
  }
  [[nodiscard]] bool is_only_asked_for_its_status() const {
    return std::ranges::all_of(host_.requests,
                               [](const auto& request) { return request.verb == ControlVerb::status; });
  }
  /// The control thread answers what it is asked, whatever the page says.
  void answer_status(ApplicationState said) {
    if (host_.requests.empty() || host_.requests.back().verb != ControlVerb::status) return;
    answer(ErrorCode::ok, encode(report_of(sut().status().pid, said)));
  }
  void go_on_for(Duration duration, std::optional<ApplicationState> said = std::nullopt) {
    for (Duration passed{}; passed <= duration; passed += milliseconds(50)) {
      sut().refresh();
      if (said) answer_status(*said);
      advance(milliseconds(50));
    }
  }
  void bring_up_and_fall_silent() {
    bring_up();
    beat();
    fall_silent();
    ASSERT_EQ(state(), InstanceState::exception);
  }
  void fall_silent_in_a_take_over() {
    bring_up();
    beat();
    ask(ControlVerb::load_application, "/opt/new.so", {{"online", "yes"}});
    sut().on_application_checked({});
    fall_silent();
  }
};

TEST_F(SilentProcess, NeverBeginsACommandThatItHadNotTaken) {
  bring_up();
  beat();
  ask(ControlVerb::force_variable, "n=9");
  EXPECT_EQ(host_.forgotten, 0);
  fall_silent();
  EXPECT_EQ(take_reply().code, ErrorCode::timed_out);
  EXPECT_EQ(host_.forgotten, 1);
}

TEST_F(SilentProcess, AnswersASingleCycleAndTheCommandBesideIt) {
  bring_up_stopped();
  beat();
  ask(ControlVerb::single_cycle);
  ask(ControlVerb::debug, "continue");
  fall_silent();
  EXPECT_EQ(replies_.size(), 2U);
  for (const ControlReply& reply : replies_) EXPECT_EQ(reply.code, ErrorCode::timed_out);
}

TEST_F(SilentProcess, IsInExceptionAndLeftAlone) {
  bring_up_and_fall_silent();
  EXPECT_THAT(problem(), HasSubstr("its control thread has not answered for 3 s"));
  EXPECT_EQ(std::get<1>(observer_.transitions.back()), InstanceState::exception)
      << "it cannot tell this itself";
  EXPECT_TRUE(host_.signals.empty());
  EXPECT_TRUE(is_only_asked_for_its_status());
}

TEST_F(SilentProcess, IsWhatItWasWhileOtherProgramsTakeItsCore) {
  bring_up();
  beat();
  host_.use.ready = {{.id = sut().status().pid, .used = {}}};
  fall_silent();
  EXPECT_EQ(problem(), "") << "it has not lasted for the limit";
  go_on_for(seconds(60));
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_THAT(problem(), HasSubstr("for 3 s: program 'hog' (process 7, SCHED_FIFO 50) has it now"));
  EXPECT_TRUE(host_.signals.empty());
  EXPECT_TRUE(host_.requests.empty());
  beat();
  EXPECT_EQ(problem(), "");
}

TEST_F(SilentProcess, IsInExceptionIfItDoesNotAnswerWhenItsCoreIsFreeAgain) {
  bring_up();
  beat();
  host_.use.ready = {{.id = sut().status().pid, .used = {}}};
  go_on_for(seconds(60));
  host_.use.ready.clear();
  go_on_for(HeartbeatWatch::kLimit - kStarvationSuspected - milliseconds(100));
  EXPECT_EQ(state(), InstanceState::running);
  go_on_for(milliseconds(200));
  EXPECT_EQ(state(), InstanceState::exception);
  EXPECT_THAT(problem(), HasSubstr("its control thread has not answered for 3 s"));
}

TEST_F(SilentProcess, IsInExceptionIfItsOwnTasksTakeItsCore) {
  bring_up();
  beat();
  host_.use.ready = {{.id = sut().status().pid, .used = {}}};
  for (Duration passed{}; passed <= HeartbeatWatch::kLimit; passed += milliseconds(50)) {
    host_.use.used += milliseconds(48);
    go_on_for(Duration::zero());
  }
  EXPECT_EQ(state(), InstanceState::exception);
}

TEST_F(SilentProcess, SaysWhyACommandIsNotAnsweredWhileOtherProgramsTakeItsCore) {
  bring_up();
  beat();
  host_.use.ready = {{.id = sut().status().pid, .used = {}}};
  ask(ControlVerb::stop);
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::stop);
  go_on_for(operation_of(ControlVerb::stop).limit);
  expire_timer();
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::timed_out);
  EXPECT_THAT(reply.text, HasSubstr("did not answer within 38 s"));
  EXPECT_THAT(reply.text, HasSubstr("program 'hog'"));
  EXPECT_TRUE(host_.signals.empty());
}

TEST_F(SilentProcess, HasMoreTimeForItsSetUpWhileOtherProgramsTakeItsCore) {
  sut().hold("is to be started");
  sut().release();
  host_.use.ready = {{.id = sut().status().pid, .used = {}}};
  go_on_for(kSetupLimit - milliseconds(100));
  EXPECT_THAT(problem(), HasSubstr("program 'hog'"));
  expire_timer();
  EXPECT_TRUE(host_.signals.empty());
  ASSERT_TRUE(host_.timer);
  EXPECT_GT(*host_.timer - now_, kSetupLimit - seconds(1));
  host_.use.ready.clear();
  go_on_for(kSetupLimit);
  expire_timer();
  EXPECT_THAT(host_.signals, ElementsAre(SIGKILL)) << "it had all of its time";
}

TEST_F(SilentProcess, HasAllOfTheTimeForItsSetUpThatItGetsOfABusyMachine) {
  sut().hold("is to be started");
  sut().release();
  now_ += kSetupLimit;
  host_.share = {.ran = seconds(1), .waited = seconds(24)};
  expire_timer();
  EXPECT_TRUE(host_.signals.empty());
  ASSERT_TRUE(host_.timer);
  EXPECT_EQ(*host_.timer - now_, seconds(24));
  EXPECT_EQ(state(), InstanceState::starting);
  // It sleeps from now on: an end that does not come.
  now_ += seconds(24);
  expire_timer();
  EXPECT_THAT(host_.signals, ElementsAre(SIGKILL));
}

TEST_F(SilentProcess, IsNotWaitedForIfItsOwnThreadsTakeTheProcessorFromEachOther) {
  sut().hold("is to be started");
  sut().release();
  now_ += kSetupLimit;
  host_.share = {.ran = kSetupLimit, .waited = 3 * kSetupLimit};
  expire_timer();
  EXPECT_THAT(host_.signals, ElementsAre(SIGKILL));
}

TEST_F(SilentProcess, SaysTheFaultThatTheProcessCouldNotTell) {
  host_.lost_fault = "task 'Main': SIGABRT: abort";
  bring_up_and_fall_silent();
  EXPECT_THAT(problem(), StartsWith("task 'Main': SIGABRT: abort; its control thread has not"));
}

// Its first cycle aborts with the lock of the heap, and its control thread wants memory before it says that
// it is up.
TEST_F(SilentProcess, IsInExceptionIfATaskIsCaughtBeforeItIsUp) {
  for (const bool caught : {true, false}) {
    make();
    host_.lost_fault = caught ? "task 'Main': SIGABRT: abort" : "";
    sut().hold("is to be started");
    sut().release();
    fall_silent();
    EXPECT_EQ(state(), InstanceState::starting)
        << "no task runs before that step: such a fault is an older one";
    sut().on_report({.step = SetupStep::make_tasks, .code = ErrorCode::ok, .text = ""});
    fall_silent();
    EXPECT_EQ(state(), caught ? InstanceState::exception : InstanceState::starting);
  }
  EXPECT_EQ(problem(), "");
  expire_timer();
  EXPECT_THAT(host_.signals, Not(IsEmpty())) << "nothing but time says that this set-up has failed";
}

TEST_F(SilentProcess, OfWhichATaskIsCaughtBeforeItIsUpIsReset) {
  host_.lost_fault = "task 'Main': SIGABRT: abort";
  sut().hold("is to be started");
  sut().release();
  sut().on_report({.step = SetupStep::make_tasks, .code = ErrorCode::ok, .text = ""});
  fall_silent();
  EXPECT_THAT(problem(), StartsWith("task 'Main': SIGABRT: abort; its control thread has not"));
  ask(ControlVerb::reset);
  EXPECT_THAT(host_.signals, ElementsAre(SIGTERM)) << "it cannot be asked to end";
}

TEST_F(SilentProcess, IsWhatItWasWhenItAnswersAgain) {
  bring_up_and_fall_silent();
  beat();
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(problem(), "");
  EXPECT_EQ(std::get<1>(observer_.transitions.back()), InstanceState::running);
  ask(ControlVerb::stop);
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::stop);
}

TEST_F(SilentProcess, IsAskedItselfIfItsPageIsDamaged) {
  for (const bool readable : {true, false}) {
    bring_up();
    beat();
    if (!readable) host_.page.reset();
    go_on_for(seconds(20), ApplicationState::running);
    EXPECT_EQ(state(), InstanceState::running) << readable;
    EXPECT_THAT(problem(), HasSubstr("damaged its status page")) << readable;
    EXPECT_TRUE(host_.signals.empty());
    sut().on_exit(killed_by(SIGKILL));
    make();
    host_.requests.clear();
  }
}

TEST_F(SilentProcess, IsInExceptionAlsoIfItsPageIsDamaged) {
  bring_up();
  beat();
  host_.page.reset();
  go_on_for(seconds(5), ApplicationState::running);
  ASSERT_EQ(state(), InstanceState::running);
  go_on_for(HeartbeatWatch::kLimit + milliseconds(600));
  EXPECT_EQ(state(), InstanceState::exception);
  EXPECT_THAT(problem(), HasSubstr("has not answered for 3 s"));
  go_on_for(seconds(3), ApplicationState::running);
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(SilentProcess, TellsItsExceptionOverTheSocketIfItsPageIsDamaged) {
  bring_up();
  beat();
  host_.page.reset();
  go_on_for(seconds(3), ApplicationState::exception);
  EXPECT_EQ(state(), InstanceState::exception);
  EXPECT_EQ(problem(), "task 'A'");
}

TEST_F(SilentProcess, IsBelievedAgainWhenItsPageBeats) {
  bring_up();
  beat();
  host_.page.reset();
  go_on_for(seconds(5), ApplicationState::running);
  ASSERT_NE(problem(), "");
  beat();
  EXPECT_EQ(problem(), "");
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(SilentProcess, IsInNoExceptionWhileItTakesOverAnotherVersion) {
  fall_silent_in_a_take_over();
  EXPECT_EQ(state(), InstanceState::running);
  sut().on_reply({.number = host_.requests.back().number, .code = ErrorCode::ok, .text = "taken over"});
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
}

TEST_F(SilentProcess, IsInExceptionWhenItsTakeOverHasNotComeToAnEnd) {
  fall_silent_in_a_take_over();
  expire_timer();
  EXPECT_EQ(take_reply().code, ErrorCode::timed_out);
  sut().refresh();
  EXPECT_EQ(state(), InstanceState::exception);
}

TEST_F(SilentProcess, IsNotAsked) {
  bring_up_and_fall_silent();
  for (const ControlVerb verb :
       {ControlVerb::start, ControlVerb::single_cycle, ControlVerb::reset_statistics}) {
    ask(verb);
    EXPECT_EQ(take_reply().code, ErrorCode::wrong_state) << to_string(verb);
  }
  EXPECT_TRUE(is_only_asked_for_its_status());
}

TEST_F(SilentProcess, IsEndedByForceAndStartedAnewByAReset) {
  bring_up_and_fall_silent();
  ask(ControlVerb::reset);
  EXPECT_THAT(host_.signals, ElementsAre(SIGTERM));
  EXPECT_EQ(*host_.timer - now_, kTerminateLimit);
  expire_timer();
  EXPECT_THAT(host_.signals, ElementsAre(SIGTERM, SIGKILL));
  EXPECT_TRUE(is_only_asked_for_its_status());
  sut().on_exit(killed_by(SIGKILL));
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::stopped);
  beat();
  ask(ControlVerb::start);
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::start) << "the next process is not to blame";
}

TEST_F(SilentProcess, IsReplacedByOneThatStandsStillWhenItIsStopped) {
  bring_up_and_fall_silent();
  ask(ControlVerb::stop);
  EXPECT_THAT(host_.signals, ElementsAre(SIGTERM));
  sut().on_exit(killed_by(SIGKILL));
  EXPECT_TRUE(host_.spawned.back().stopped);
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::stopped);
}

TEST_F(SilentProcess, BreaksOffWhatItWasToAnswer) {
  bring_up();
  beat();
  ask(ControlVerb::stop);
  fall_silent();
  EXPECT_EQ(state(), InstanceState::exception);
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::timed_out);
  EXPECT_THAT(reply.text, HasSubstr("reset it. If it runs on, its next process is stopped all the same"));
  EXPECT_FALSE(host_.timer);
}

}  // namespace
}  // namespace plchost
