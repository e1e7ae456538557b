// A process that a new manager takes over and that says nothing of itself: no status page, no answer.
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

class Unheard : public ManagedInstanceTest {
 protected:
  void adopt() {
    host_.adoptable = 77;
    host_.requests.clear();
    observer_.transitions.clear();
    make();
    ASSERT_TRUE(sut().adopt());
  }
  void adopt_one_that_was_up() {
    bring_up();
    adopt();
  }
  void adopt_one_in_its_set_up() {
    sut().hold("is to be started");
    sut().release();
    adopt();
  }
  /// As the reactor does it: a look each 50 ms, and the timer.
  void go_on_for(Duration duration) {
    for (Duration passed{}; passed < duration; passed += milliseconds(50)) {
      advance(milliseconds(50));
      sut().refresh();
      if (host_.timer && *host_.timer <= now_) {
        host_.timer.reset();
        sut().on_timer();
      }
    }
  }
  void answer_with(ApplicationState said, const std::string& application = "/opt/line.so") {
    ASSERT_FALSE(host_.requests.empty());
    ASSERT_EQ(host_.requests.back().verb, ControlVerb::status);
    InstanceReport report = report_of(77, said);
    report.application = application;
    report.scheduler = "CmpScheduleTimer";
    answer(ErrorCode::ok, encode(report));
  }
  void show_page() {
    InstanceRuntime page;
    page.pid = 77;
    page.state = ApplicationState::running;
    page.running = 1;
    page.application.assign("/opt/line.so");
    page.heartbeat_ns = now_.time_since_epoch().count();
    host_.page = page;
  }
  [[nodiscard]] bool was_shown(InstanceState state) const {
    return std::ranges::any_of(observer_.transitions,
                               [&](const auto& told) { return std::get<1>(told) == state; });
  }
};

TEST_F(Unheard, IsStartingWithAProblem) {
  adopt_one_in_its_set_up();
  go_on_for(kAdoptLimit + seconds(1));
  EXPECT_EQ(state(), InstanceState::starting);
  EXPECT_THAT(problem(), HasSubstr("has no status page and does not answer on its control socket"));
  EXPECT_EQ(sut().status().pid, 77);
  EXPECT_FALSE(sut().ready()) << "its successors wait";
  EXPECT_FALSE(was_shown(InstanceState::running));
}

TEST_F(Unheard, IsAskedUntilItAnswers) {
  adopt_one_in_its_set_up();
  go_on_for(seconds(20));
  EXPECT_GE(host_.requests.size(), 8U);
  answer_with(ApplicationState::stopped);
  EXPECT_EQ(state(), InstanceState::stopped);
  EXPECT_EQ(sut().status().scheduler.view(), "CmpScheduleTimer");
}

TEST_F(Unheard, IsAskedOnAlsoIfTheQuestionCouldNotBeSent) {
  bring_up();
  host_.can_send = false;
  adopt();
  EXPECT_EQ(state(), InstanceState::starting);
  EXPECT_THAT(problem(), HasSubstr("nobody listens"));
  host_.can_send = true;
  go_on_for(seconds(1));
  answer_with(ApplicationState::running);
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(Unheard, IsWhatItsAnswerSaysAndItsPageIsMissed) {
  adopt_one_that_was_up();
  answer_with(ApplicationState::running);
  EXPECT_EQ(state(), InstanceState::running);
  for (int i = 0; i < 10; ++i) {
    go_on_for(milliseconds(500));
    answer_with(ApplicationState::running);
  }
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_THAT(problem(), HasSubstr("status page"));
  EXPECT_THAT(host_.signals, IsEmpty());
}

TEST_F(Unheard, IsWhatItsPageSaysWhenThatComes) {
  adopt_one_in_its_set_up();
  go_on_for(seconds(10));
  show_page();
  go_on_for(milliseconds(50));
  EXPECT_EQ(state(), InstanceState::running);
}

// The manager before ended in the set-up that a load began.
TEST_F(Unheard, HasNoApplicationBeforeOnceItAnswers) {
  bring_up();
  wishes_.wish->application_before = "/opt/earlier.so";
  wishes_.wish->process = InstanceWish::Process::setting_up;
  adopt();
  go_on_for(kSetupLimit + seconds(1));
  ASSERT_EQ(state(), InstanceState::exception);
  EXPECT_EQ(wishes_.wish->application_before, "/opt/earlier.so");
  answer_with(ApplicationState::running);
  go_on_for(milliseconds(50));
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(wishes_.wish->application_before, "");
}

TEST_F(Unheard, GivesWayToTheApplicationBeforeIfItEndsInItsSetUp) {
  bring_up();
  wishes_.wish->application_before = "/opt/earlier.so";
  wishes_.wish->process = InstanceWish::Process::setting_up;
  adopt();
  go_on_for(seconds(1));
  sut().on_exit(exited_with(kExitSetupFailed));
  ASSERT_FALSE(host_.spawned.empty());
  EXPECT_EQ(host_.spawned.back().application, "/opt/earlier.so");
}

TEST_F(Unheard, IsInExceptionIfItWasUp) {
  adopt_one_that_was_up();
  go_on_for(kAdoptLimit + seconds(1));
  EXPECT_EQ(state(), InstanceState::exception);
  EXPECT_THAT(problem(), HasSubstr("its control thread has not answered for 3 s"));
  EXPECT_THAT(problem(), HasSubstr("no status page"));
  EXPECT_THAT(host_.signals, IsEmpty());
  EXPECT_FALSE(was_shown(InstanceState::running));
}

TEST_F(Unheard, IsInExceptionIfItsSetUpDoesNotComeToAnEnd) {
  adopt_one_in_its_set_up();
  go_on_for(kSetupLimit - milliseconds(100));
  EXPECT_EQ(state(), InstanceState::starting);
  go_on_for(seconds(1));
  EXPECT_EQ(state(), InstanceState::exception);
  EXPECT_THAT(host_.signals, IsEmpty()) << "it may be a machine that runs";
}

TEST_F(Unheard, IsWhatItSaysWhenItAnswersAfterAll) {
  adopt_one_that_was_up();
  go_on_for(seconds(10));
  ASSERT_EQ(state(), InstanceState::exception);
  answer_with(ApplicationState::stopped, "/opt/other.so");
  go_on_for(milliseconds(50));
  EXPECT_EQ(state(), InstanceState::stopped);
  EXPECT_EQ(sut().status().application.view(), "/opt/other.so");
  EXPECT_EQ(sut().status().scheduler.view(), "CmpScheduleTimer");
}

TEST_F(Unheard, IsNotInExceptionWhileOtherProgramsTakeItsCore) {
  adopt_one_that_was_up();
  host_.use.ready = {{.id = 77, .used = {}}};
  go_on_for(seconds(60));
  EXPECT_EQ(state(), InstanceState::starting);
  EXPECT_THAT(problem(), HasSubstr("program 'hog'"));
  EXPECT_THAT(problem(), HasSubstr("no status page"));
  host_.use.ready.clear();
  go_on_for(seconds(5));
  EXPECT_EQ(state(), InstanceState::exception);
}

TEST_F(Unheard, AnswersTheCommandsThatWaitedForIt) {
  for (const ControlVerb verb : {ControlVerb::start, ControlVerb::register_event}) {
    adopt_one_that_was_up();
    ask(verb, verb == ControlVerb::start ? "" : "ready");
    EXPECT_THAT(replies_, IsEmpty());
    go_on_for(kAdoptLimit + seconds(1));
    const ControlReply reply = take_reply();
    EXPECT_EQ(reply.code, ErrorCode::wrong_state) << to_string(verb);
    EXPECT_THAT(reply.text, HasSubstr("reset it first"));
    make();
  }
}

TEST_F(Unheard, IsReplacedByAStopThatWaitedForIt) {
  adopt_one_that_was_up();
  ask(ControlVerb::stop);
  go_on_for(kAdoptLimit + seconds(1));
  EXPECT_THAT(host_.signals, ElementsAre(SIGTERM));
  host_.adoptable.reset();
  sut().on_exit(ExitStatus{.known = false});
  EXPECT_TRUE(host_.spawned.back().stopped);
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::stopped);
}

TEST_F(Unheard, IsStillInItsSetUpForTheManagerAfterThis) {
  adopt_one_in_its_set_up();
  go_on_for(seconds(10));
  ASSERT_TRUE(wishes_.wish);
  EXPECT_EQ(wishes_.wish->process, InstanceWish::Process::setting_up);
}

TEST_F(Unheard, IsNotStartedAgainOnAGuess) {
  wishes_.damaged = true;
  adopt();
  go_on_for(kSetupLimit + seconds(1));
  EXPECT_EQ(state(), InstanceState::exception);
  EXPECT_EQ(wishes_.writes, 0) << "the process has not said whether it runs";
  host_.adoptable.reset();
  sut().on_exit(ExitStatus{.known = false});
  EXPECT_EQ(state(), InstanceState::failed);
  EXPECT_THAT(problem(), HasSubstr("its wanted state is not known"));
  EXPECT_THAT(host_.spawned, IsEmpty());
}

// Its wish is not there, so only the configuration can say that it runs.
TEST_F(Unheard, OfWhichNobodyHasSpokenFollowsItsConfigurationWhenItEnds) {
  struct {
    bool autostart;
    RestartPolicy restart;
    InstanceState wanted;
  } const cases[] = {{false, RestartPolicy::never, InstanceState::offline},
                     {false, RestartPolicy::on_failure, InstanceState::offline},
                     {false, RestartPolicy::always, InstanceState::offline},
                     {true, RestartPolicy::never, InstanceState::failed},
                     {true, RestartPolicy::on_failure, InstanceState::waiting},
                     {true, RestartPolicy::always, InstanceState::waiting}};
  for (const auto& one : cases) {
    for (const bool silent : {false, true}) {
      SCOPED_TRACE(fmt::format("autostart {}, policy {}, silent {}", one.autostart,
                               std::to_underlying(one.restart), silent));
      config_.autostart = one.autostart;
      config_.restart = one.restart;
      wishes_.wish.reset();
      host_.spawned.clear();
      adopt();
      if (silent) go_on_for(kSetupLimit + seconds(1));
      host_.adoptable.reset();
      sut().on_exit(ExitStatus{.known = false});
      EXPECT_EQ(state(), one.wanted);
      go_on_for(seconds(1));
      EXPECT_EQ(host_.spawned.size(), one.wanted == InstanceState::waiting ? 1U : 0U);
    }
  }
}

TEST_F(Unheard, OfWhichNobodyHasSpokenStaysStoppedIfItIsFoundOnItsWayThere) {
  for (const ApplicationState found :
       {ApplicationState::stopped, ApplicationState::stopping, ApplicationState::single_cycle}) {
    SCOPED_TRACE(std::to_underlying(found));
    wishes_.wish.reset();
    adopt();
    answer_with(found);
    ASSERT_TRUE(wishes_.wish);
    adopt();  // by the next manager
    host_.spawned.clear();
    host_.adoptable.reset();
    sut().on_exit(ExitStatus{.known = false});
    go_on_for(seconds(1));
    ASSERT_EQ(host_.spawned.size(), 1U);
    EXPECT_TRUE(host_.spawned.back().stopped);
  }
}

// A control thread that goes on after 20 s answers all questions in a row, before its page beats.
TEST_F(Unheard, IsNotSaidToHaveADamagedPageForAnswersToOldQuestions) {
  adopt_one_in_its_set_up();
  go_on_for(seconds(20));
  const auto asked = host_.requests;
  for (const ControlRequest& request : asked) {
    sut().on_reply({.number = request.number,
                    .code = ErrorCode::ok,
                    .text = encode(report_of(77, ApplicationState::running))});
  }
  show_page();
  sut().refresh();
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_THAT(problem(), Not(HasSubstr("status page")));
}

}  // namespace
}  // namespace plchost
