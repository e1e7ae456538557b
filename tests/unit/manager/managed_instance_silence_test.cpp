// A process whose control thread beats no more: what is shown, and what each command does.
#include <csignal>

#include "tests/unit/manager/managed_instance_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
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

TEST_F(SilentProcess, IsInExceptionAndLeftAlone) {
  bring_up_and_fall_silent();
  EXPECT_THAT(problem(), HasSubstr("its control thread has not answered for 3 s"));
  EXPECT_EQ(std::get<1>(transitions_.back()), InstanceState::exception) << "it cannot tell this itself";
  EXPECT_TRUE(host_.signals.empty());
  EXPECT_TRUE(host_.requests.empty());
}

TEST_F(SilentProcess, SaysTheFaultThatTheProcessCouldNotTell) {
  lost_fault_ = "task 'Main': SIGABRT: abort";
  bring_up_and_fall_silent();
  EXPECT_THAT(problem(), StartsWith("task 'Main': SIGABRT: abort; its control thread has not"));
}

TEST_F(SilentProcess, IsWhatItWasWhenItAnswersAgain) {
  bring_up_and_fall_silent();
  beat();
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(problem(), "");
  EXPECT_EQ(std::get<1>(transitions_.back()), InstanceState::running);
  ask(ControlVerb::stop);
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::stop);
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
  EXPECT_TRUE(host_.requests.empty());
}

TEST_F(SilentProcess, IsEndedByForceAndStartedAnewByAReset) {
  bring_up_and_fall_silent();
  ask(ControlVerb::reset);
  EXPECT_THAT(host_.signals, ElementsAre(SIGTERM));
  EXPECT_EQ(*host_.timer - now_, kTerminateLimit);
  expire_timer();
  EXPECT_THAT(host_.signals, ElementsAre(SIGTERM, SIGKILL));
  EXPECT_TRUE(host_.requests.empty());
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
  EXPECT_THAT(reply.text, HasSubstr("reset it"));
  EXPECT_FALSE(host_.timer);
}

}  // namespace
}  // namespace plchost
