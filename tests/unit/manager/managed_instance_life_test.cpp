// The life of the application as the manager sees it: exception, single cycle, cold reset, kinds of start.
#include <csignal>
#include <utility>

#include "shm/process/dynamic_loader.hpp"
#include "tests/unit/manager/managed_instance_fixture.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class ManagedLife : public ManagedInstanceTest {
 protected:
  void show(ApplicationState state, std::string_view problem = "") {
    InstanceRuntime runtime;
    runtime.pid = sut().status().pid;
    runtime.running = state == ApplicationState::running ? 1 : 0;
    runtime.state = state;
    runtime.scheduler.assign("CmpSchedule");
    runtime.application.assign(config_.application);
    runtime.problem.assign(problem);
    host_.page = runtime;
  }
  void fall_into_exception() {
    bring_up();
    show(ApplicationState::exception, "task 'Main': division by zero");
    sut().refresh();
    ASSERT_EQ(state(), InstanceState::exception);
  }
  StartKind last_kind() { return host_.spawned.back().start_kind; }
};

TEST_F(ManagedLife, IsInExceptionBeforeTheStopThatLedToItIsAnswered) {
  bring_up();
  std::optional<InstanceState> when_answered;
  sut().handle({.number = 7, .verb = ControlVerb::stop, .instance = "line1", .argument = "", .options = {}},
               [&](const ControlReply& /*reply*/) { when_answered = state(); });
  show(ApplicationState::exception, "stop_timeout");
  answer(ErrorCode::timed_out, "it is in exception now");
  EXPECT_EQ(when_answered, InstanceState::exception);
}

TEST_F(ManagedLife, ShowsAnExceptionAtTheNextLookAndLeavesTheProcessAlone) {
  fall_into_exception();
  EXPECT_EQ(problem(), "task 'Main': division by zero");
  advance(std::chrono::hours(1));
  sut().refresh();
  EXPECT_EQ(state(), InstanceState::exception);
  EXPECT_EQ(host_.spawned.size(), 1U);
  EXPECT_TRUE(host_.signals.empty());
  EXPECT_TRUE(host_.requests.empty());
}

TEST_F(ManagedLife, RefusesToRunInExceptionAndSaysWhatHelps) {
  fall_into_exception();
  for (const ControlVerb verb : {ControlVerb::start, ControlVerb::single_cycle}) {
    ask(verb);
    const auto reply = take_reply();
    EXPECT_EQ(reply.code, ErrorCode::wrong_state) << to_string(verb);
    EXPECT_EQ(reply.text, "'line1' is in exception: task 'Main': division by zero; reset it first");
  }
  ask(ControlVerb::stop);
  const auto stop = take_reply();
  EXPECT_EQ(stop.code, ErrorCode::ok);
  EXPECT_THAT(stop.text, HasSubstr("does not run"));
  EXPECT_TRUE(host_.requests.empty());
}

TEST_F(ManagedLife, KnowsOfAnExceptionWhenACommandComesBeforeTheNextLook) {
  bring_up();
  show(ApplicationState::exception, "late");
  ask(ControlVerb::start);
  EXPECT_EQ(take_reply().code, ErrorCode::wrong_state);
}

TEST_F(ManagedLife, ResetLeadsOutOfAnException) {
  fall_into_exception();
  ask(ControlVerb::reset);
  sut().on_exit(exited_with(1));
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::stopped);
  EXPECT_EQ(problem(), "");
}

TEST_F(ManagedLife, IsStoppingUntilTheStopIsAnswered) {
  bring_up();
  ask(ControlVerb::stop);
  EXPECT_EQ(state(), InstanceState::stopping);
  ASSERT_TRUE(host_.timer);
  EXPECT_GE(*host_.timer - now_, std::chrono::seconds(35));  // both phases fit in
  answer();
  EXPECT_EQ(state(), InstanceState::stopped);
}

TEST_F(ManagedLife, ShowsWhatAFailedStopHasLedTo) {
  bring_up();
  ask(ControlVerb::stop);
  show(ApplicationState::exception, "stop_timeout: task Main");
  answer(ErrorCode::timed_out, "task Main");
  EXPECT_EQ(take_reply().code, ErrorCode::timed_out);
  EXPECT_EQ(state(), InstanceState::exception);
  EXPECT_EQ(problem(), "stop_timeout: task Main");
}

TEST_F(ManagedLife, PassesASingleCycleOnAndStaysStopped) {
  bring_up_stopped();
  ask(ControlVerb::single_cycle);
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::single_cycle);
  EXPECT_TRUE(replies_.empty());
  answer();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::stopped);
}

TEST_F(ManagedLife, CarriesOutCommandsForATaskThatHaltsInASingleCycle) {
  bring_up_stopped();
  ask(ControlVerb::single_cycle);
  const std::uint64_t cycle = host_.requests.back().number;
  const auto until = host_.timer;
  for (const ControlVerb verb : {ControlVerb::debug, ControlVerb::write_variable, ControlVerb::force_variable,
                                 ControlVerb::unforce_variable}) {
    ask(verb, "continue");
    EXPECT_EQ(host_.requests.back().verb, verb);
    answer();
    EXPECT_EQ(take_reply().code, ErrorCode::ok);
    EXPECT_EQ(host_.timer, until) << "the cycle has its own limit";
  }
  ask(ControlVerb::set_scheduler, "CmpSchedule");
  EXPECT_EQ(take_reply().code, ErrorCode::busy);
  ask(ControlVerb::debug, "continue");
  sut().on_reply({.number = cycle, .code = ErrorCode::ok, .text = ""});
  EXPECT_EQ(take_reply().code, ErrorCode::ok) << "of the cycle";
  answer();
  EXPECT_EQ(take_reply().code, ErrorCode::ok) << "of the debugger";
}

TEST_F(ManagedLife, LetsNoCommandWaitForAnOrderThatWaits) {
  bring_up();
  ask(ControlVerb::write_variable, "n=1");
  const std::uint64_t first = host_.requests.back().number;
  ask(ControlVerb::force_variable, "m=2");
  const std::uint64_t second = host_.requests.back().number;
  ask(ControlVerb::stop);
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::stop);
  answer();
  EXPECT_EQ(take_reply().code, ErrorCode::ok) << "of the stop";
  sut().on_reply({.number = second, .code = ErrorCode::ok, .text = "'m' is forced"});
  EXPECT_EQ(take_reply().text, "'m' is forced");
  ask(ControlVerb::reset);
  sut().on_reply({.number = first, .code = ErrorCode::timed_out, .text = "nothing is changed"});
  EXPECT_EQ(take_reply().text, "nothing is changed");
  sut().on_exit(exited_with(0));
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok) << "of the reset";
}

TEST_F(ManagedLife, AnswersAnOrderThatItsProcessDoesNot) {
  bring_up();
  ask(ControlVerb::write_variable, "n=1");
  ask(ControlVerb::stop);
  answer();
  EXPECT_EQ(take_reply().code, ErrorCode::ok) << "of the stop";
  now_ += kCommandLimit;
  sut().refresh();
  EXPECT_EQ(take_reply().code, ErrorCode::timed_out);
}

TEST_F(ManagedLife, BreaksASingleCycleOffForAStopAndAReset) {
  for (const ControlVerb verb : {ControlVerb::stop, ControlVerb::reset, ControlVerb::restart}) {
    make();
    bring_up_stopped();
    ask(ControlVerb::single_cycle);
    show(ApplicationState::single_cycle);
    ask(verb);
    const auto broken = take_reply();
    EXPECT_EQ(broken.code, ErrorCode::wrong_state);
    EXPECT_EQ(broken.text, fmt::format("broken off by '{}'", to_string(verb)));
    if (verb == ControlVerb::stop) {
      EXPECT_EQ(host_.requests.back().verb, ControlVerb::stop) << "its tasks are within their cycles";
      answer();
    } else {
      sut().on_exit(exited_with(0));
      report_ready();
    }
    EXPECT_EQ(take_reply().code, ErrorCode::ok);
  }
}

TEST_F(ManagedLife, AnswersASingleCycleAndTheCommandBesideItWhenTheProcessEnds) {
  bring_up_stopped();
  ask(ControlVerb::single_cycle);
  ask(ControlVerb::write_variable, "n=1");
  sut().on_exit(killed_by(SIGKILL));
  EXPECT_EQ(replies_.size(), 2U);
  for (const ControlReply& reply : replies_) EXPECT_NE(reply.code, ErrorCode::ok);
}

TEST_F(ManagedLife, GivesAnEndingProcessTheTimeOfBothPhases) {
  bring_up();
  ask(ControlVerb::reset);
  ASSERT_TRUE(host_.timer);
  EXPECT_GE(*host_.timer - now_, std::chrono::seconds(35));
}

TEST_F(ManagedLife, TellsTheApplicationWhyItStarts) {
  bring_up();
  EXPECT_EQ(last_kind(), StartKind::first);
  sut().on_exit(killed_by(SIGSEGV));
  expire_timer();
  report_ready();
  EXPECT_EQ(last_kind(), StartKind::after_fault);
  const auto renew = [&](ControlVerb verb) {
    ask(verb);
    sut().on_exit(exited_with(0));
    report_ready();
    EXPECT_EQ(take_reply().code, ErrorCode::ok);
    return last_kind();
  };
  EXPECT_EQ(renew(ControlVerb::reset), StartKind::warm);
  EXPECT_TRUE(host_.spawned.back().stopped);
  EXPECT_EQ(renew(ControlVerb::reset_cold), StartKind::cold);
  EXPECT_TRUE(host_.spawned.back().stopped);
  EXPECT_EQ(renew(ControlVerb::restart), StartKind::warm);
  EXPECT_FALSE(host_.spawned.back().stopped);
}

TEST_F(ManagedLife, TellsAStepThatItsTableHasNot) {
  bring_up();
  sut().hold("as no supervisor does it");
  EXPECT_THAT(std::exchange(observer_.wrong, {}), ElementsAre("'up' does not lead to 'held'"));
}

TEST_F(ManagedLife, TellsOfEachChangeOfTheProcessOnceAndOfNoneOfTheApplication) {
  bring_up();
  ask(ControlVerb::stop);
  answer();
  take_reply();
  ask(ControlVerb::reset);
  sut().on_exit(exited_with(0));
  report_ready();
  using enum InstanceState;
  std::vector<std::pair<InstanceState, InstanceState>> told;
  for (const auto& [from, to, reason] : observer_.transitions) told.emplace_back(from, to);
  EXPECT_THAT(told, ElementsAre(std::pair(offline, waiting), std::pair(waiting, starting),
                                std::pair(starting, running), std::pair(InstanceState::stopped, stopping),
                                std::pair(stopping, starting), std::pair(starting, InstanceState::stopped)));
}

TEST_F(ManagedLife, AdoptsAnInstanceInExceptionAsSuch) {
  host_.adoptable = 55;
  ASSERT_TRUE(sut().adopt());
  show(ApplicationState::exception, "task 'Main': stack overflow");
  answer();
  EXPECT_EQ(state(), InstanceState::exception);
  EXPECT_EQ(problem(), "task 'Main': stack overflow");
}

TEST_F(ManagedLife, AdoptsAnInstanceThatIsStoppingAndSeesItStopped) {
  host_.adoptable = 55;
  ASSERT_TRUE(sut().adopt());
  show(ApplicationState::stopping);
  answer();
  EXPECT_EQ(state(), InstanceState::stopping);
  show(ApplicationState::stopped);
  advance(kPageLag);
  sut().refresh();
  EXPECT_EQ(state(), InstanceState::stopped);
}

// A host that is short of something for a moment is no fault of the instance.
class ShortOfSomething : public ManagedInstanceTest {
 protected:
  void fail_set_up() {
    sut().on_report({.step = SetupStep::attach_pool,
                     .code = ErrorCode::timed_out,
                     .text = "the pool is locked by process 7",
                     .transient = true});
    sut().on_exit(exited_with(kExitSetupFailed));
  }
};

TEST_F(ShortOfSomething, IsTriedAgainWithBackOffAndIsNoCrash) {
  sut().hold("is to be started");
  sut().release();
  constexpr int kMoreThanTheCrashLimit = 10;
  Duration before{};
  for (int i = 0; i < kMoreThanTheCrashLimit; ++i) {
    fail_set_up();
    ASSERT_EQ(state(), InstanceState::waiting) << problem();
    EXPECT_THAT(problem(), HasSubstr("locked by process 7"));
    EXPECT_GE(*host_.timer - now_, before);
    before = *host_.timer - now_;
    expire_timer();
  }
  EXPECT_EQ(before, config_.restart_delay_max);
  report_ready();
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(ShortOfSomething, ThatTheProgramNeedsToBeLoadedIsNoCrash) {
  host_.said =
      "plc-instance: error while loading shared libraries: libm.so.6: cannot open shared object file: Error "
      "24";
  sut().hold("is to be started");
  sut().release();
  for (int i = 0; i < 10; ++i) {
    sut().on_exit(exited_with(kExitNotLoaded));
    ASSERT_EQ(state(), InstanceState::waiting) << problem();
    EXPECT_THAT(problem(), AllOf(HasSubstr("libm.so.6"), HasSubstr("Error 24"), HasSubstr("starts again")));
    expire_timer();
  }
  report_ready();
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(ManagedLife, FailsIfALibraryOfTheProgramIsMissing) {
  for (const std::string text : {"plc-instance: error while loading shared libraries: libm.so.6: cannot open "
                                 "shared object file: No such file or directory",
                                 ""}) {
    make();
    host_.said = text;
    sut().hold("is to be started");
    sut().release();
    sut().on_exit(exited_with(kExitNotLoaded));
    EXPECT_EQ(state(), InstanceState::failed);
    EXPECT_THAT(problem(), HasSubstr(text.empty() ? "could not be loaded" : text));
  }
}

// Its code has run by then, so it is a crash, which on_failure repeats.
TEST_F(ManagedLife, CountsTheSameExitCodeAsACrashAfterTheFirstStep) {
  host_.said = "plc-instance: error while loading shared libraries: x.so: file too short";
  sut().hold("is to be started");
  sut().release();
  sut().on_report({.step = SetupStep::bind_core, .code = ErrorCode::ok, .text = ""});
  sut().on_exit(exited_with(kExitNotLoaded));
  EXPECT_EQ(state(), InstanceState::waiting);
  EXPECT_THAT(problem(), HasSubstr("exit code 127; crash 1 of 3 within 10 s; starts again"));
}

TEST_F(ShortOfSomething, OfProcessesIsTriedAgain) {
  host_.can_spawn = false;
  host_.spawn_errno = EAGAIN;
  sut().hold("is to be started");
  sut().release();
  ASSERT_EQ(state(), InstanceState::waiting);
  host_.can_spawn = true;
  expire_timer();
  EXPECT_EQ(state(), InstanceState::starting);
}

TEST_F(ShortOfSomething, UnderThePolicyNeverFails) {
  config_.restart = RestartPolicy::never;
  make();
  sut().hold("is to be started");
  sut().release();
  fail_set_up();
  EXPECT_EQ(state(), InstanceState::failed);
}

TEST_F(ShortOfSomething, IsForgottenWhenTheNextStartFailsForGood) {
  sut().hold("is to be started");
  sut().release();
  fail_set_up();
  expire_timer();
  sut().on_report({.step = SetupStep::read_settings, .code = ErrorCode::not_found, .text = "no line.cfg"});
  sut().on_exit(exited_with(kExitSetupFailed));
  EXPECT_EQ(state(), InstanceState::failed);
}

}  // namespace
}  // namespace plchost
