// The wish of an instance, over the end of its manager and over a power cut.

#include <csignal>

#include "tests/unit/manager/managed_instance_fixture.hpp"

namespace plchost {
namespace {

using testing::AnyOf;
using testing::HasSubstr;
using testing::IsEmpty;

enum class Death : bool { manager_killed, power_cut };

/// Each test is of an instance whose process has ended, too, unless it says otherwise.
class InstanceWishes : public ManagedInstanceTest, public testing::WithParamInterface<Death> {
 protected:
  /// The host's memory is gone with its power; the disk is not.
  void end_manager() {
    if (GetParam() == Death::power_cut && wishes_.wish) wishes_.wish = wishes_.wish->after_power_cut();
    host_.spawned.clear();
    host_.requests.clear();
    host_.timer.reset();
    replies_.clear();
  }
  /// As Supervisor::start() does.
  void begin_next_manager() {
    make();
    if (!sut().adopt()) sut().resume();
    sut().release();
    if (state() == InstanceState::waiting) expire_timer();
  }
  void next_manager() {
    end_manager();
    begin_next_manager();
  }
  [[nodiscard]] const LaunchOptions& only_start() {
    EXPECT_EQ(host_.spawned.size(), 1U);
    static const LaunchOptions kNone;
    return host_.spawned.empty() ? kNone : host_.spawned.front();
  }
  void stop() {
    ask(ControlVerb::stop);
    answer();
    ASSERT_EQ(take_reply().code, ErrorCode::ok);
  }
};

TEST_P(InstanceWishes, ThatRanRunsAgain) {
  bring_up();
  next_manager();
  EXPECT_FALSE(only_start().stopped);
  EXPECT_EQ(only_start().start_kind,
            GetParam() == Death::power_cut ? StartKind::first : StartKind::after_fault);
}

TEST_P(InstanceWishes, ThatAnOperatorStoppedComesUpStopped) {
  bring_up();
  stop();
  next_manager();
  EXPECT_TRUE(only_start().stopped);
  report_ready();
  EXPECT_EQ(state(), InstanceState::stopped);
}

TEST_P(InstanceWishes, WhoseStopIsUnderWayComesUpStopped) {
  bring_up();
  ask(ControlVerb::stop);
  next_manager();
  EXPECT_TRUE(only_start().stopped);
}

TEST_P(InstanceWishes, ThatWasResetComesUpStopped) {
  bring_up();
  ask(ControlVerb::reset);  // its process is still ending
  next_manager();
  EXPECT_TRUE(only_start().stopped);
}

TEST_P(InstanceWishes, WhoseStartWasCancelledStaysOffline) {
  bring_up();
  sut().on_exit(killed_by(SIGSEGV));
  ask(ControlVerb::stop);
  take_reply();
  ASSERT_EQ(state(), InstanceState::offline);
  next_manager();
  EXPECT_EQ(state(), InstanceState::offline);
  EXPECT_THAT(host_.spawned, IsEmpty());
}

TEST_P(InstanceWishes, ThatFailedStaysFailed) {
  config_.restart = RestartPolicy::never;
  make();
  bring_up();
  sut().on_exit(killed_by(SIGSEGV));
  ASSERT_EQ(state(), InstanceState::failed);
  next_manager();
  EXPECT_EQ(state(), InstanceState::failed);
  EXPECT_EQ(problem(), "killed by SIGSEGV");
  EXPECT_THAT(host_.spawned, IsEmpty());
  next_manager();  // once more
  EXPECT_EQ(state(), InstanceState::failed);
  ask(ControlVerb::start);
  EXPECT_EQ(host_.spawned.size(), 1U);
}

TEST_P(InstanceWishes, WhosePolicyIsNeverIsStartedByTheHostOnly) {
  config_.restart = RestartPolicy::never;
  make();
  bring_up();
  next_manager();
  EXPECT_EQ(host_.spawned.size(), GetParam() == Death::power_cut ? 1U : 0U);
  EXPECT_EQ(state(), GetParam() == Death::power_cut ? InstanceState::starting : InstanceState::failed);
}

TEST_P(InstanceWishes, ThatOnlyAnOperatorStartsAndWhosePolicyIsNeverFails) {
  config_.restart = RestartPolicy::never;
  config_.autostart = false;
  make();
  ask(ControlVerb::start);
  report_ready();
  take_reply();
  next_manager();
  EXPECT_EQ(state(), InstanceState::failed);
  EXPECT_THAT(host_.spawned, IsEmpty());
}

TEST_P(InstanceWishes, ThatAnOperatorStartedRunsWithoutAutostart) {
  config_.autostart = false;
  make();
  ask(ControlVerb::start);
  report_ready();
  take_reply();
  next_manager();
  EXPECT_FALSE(only_start().stopped);
}

TEST_P(InstanceWishes, ThatNobodyAskedForIsAsItsConfigurationSays) {
  bring_up();
  config_.autostart = false;
  next_manager();
  EXPECT_EQ(state(), InstanceState::offline);
}

TEST_P(InstanceWishes, InSafeModeStaysThere) {
  reach_safe_mode();
  const std::uint32_t restarts = sut().status().restarts;
  next_manager();
  EXPECT_EQ(only_start().application, "");
  report_ready();
  EXPECT_EQ(state(), InstanceState::safe_mode);
  EXPECT_GE(sut().status().restarts, restarts);
  ask(ControlVerb::load_application, "/opt/good.so");
  sut().on_application_checked({});
  sut().on_exit(exited_with(0));
  EXPECT_EQ(host_.spawned.back().application, "/opt/good.so");
}

TEST_P(InstanceWishes, KeepsItsSchedulerAndItsApplication) {
  bring_up();
  ask(ControlVerb::set_scheduler, "CmpScheduleTimer");
  answer();
  take_reply();
  ask(ControlVerb::load_application, "/opt/other.so");
  sut().on_application_checked({});
  sut().on_exit(exited_with(0));
  report_ready();
  take_reply();
  next_manager();
  EXPECT_EQ(only_start().scheduler, "CmpScheduleTimer");
  EXPECT_EQ(only_start().application, "/opt/other.so");
}

TEST_P(InstanceWishes, BeginsWithTheBootApplicationOnlyWithTheHost) {
  bring_up();
  ask(ControlVerb::load_application, "/opt/other.so");
  sut().on_application_checked({});
  sut().on_exit(exited_with(0));
  report_ready();
  take_reply();
  applications_.boot_path = "/opt/boot.so";
  next_manager();
  EXPECT_EQ(only_start().application, GetParam() == Death::power_cut ? "/opt/boot.so" : "/opt/other.so");
}

// find() waits for it longer than a look at the applications does.
TEST_P(InstanceWishes, OfASlowDiskDoNotHideTheBootApplication) {
  bring_up();
  wishes_.on_find = [this] { applications_.boot_path = "/opt/boot.so"; };
  next_manager();
  EXPECT_EQ(only_start().application, GetParam() == Death::power_cut ? "/opt/boot.so" : "/opt/line.so");
}

TEST_P(InstanceWishes, OfAChangedConfigurationTakesEffectAndStartsNothing) {
  bring_up();
  stop();
  config_.application = "/opt/newer.so";
  config_.scheduler = "CmpScheduleTimer";
  next_manager();
  EXPECT_EQ(only_start().application, "/opt/newer.so");
  EXPECT_EQ(only_start().scheduler, "CmpScheduleTimer");
  EXPECT_TRUE(only_start().stopped);
}

TEST_P(InstanceWishes, ThatFailedBeginsAnewWithAnotherConfiguredApplication) {
  config_.restart = RestartPolicy::never;
  make();
  bring_up();
  sut().on_exit(killed_by(SIGSEGV));
  config_.application = "/opt/newer.so";
  next_manager();
  EXPECT_EQ(only_start().application, "/opt/newer.so");
}

TEST_P(InstanceWishes, ThatFailedBeginsAnewWithOtherSettings) {
  bring_up();
  ask(ControlVerb::restart);
  sut().on_exit(exited_with(0));
  sut().on_exit(exited_with(kExitSetupFailed));
  ASSERT_EQ(state(), InstanceState::failed);
  config_.settings = "/etc/plchost/mended.cfg";
  next_manager();
  EXPECT_EQ(only_start().settings, "/etc/plchost/mended.cfg");
}

TEST_P(InstanceWishes, KeepsItsCrashesAndItsRestarts) {
  bring_up();
  crash_once();
  crash_once();
  ASSERT_EQ(sut().status().restarts, 2U);
  next_manager();  // a process that ended while no manager ran is the third crash
  report_ready();
  if (GetParam() == Death::power_cut) {
    EXPECT_EQ(state(), InstanceState::running);
    EXPECT_EQ(sut().status().restarts, 2U);
    sut().on_exit(killed_by(SIGSEGV));
    expire_timer();
    report_ready();
  }
  EXPECT_EQ(sut().status().restarts, 3U);
  EXPECT_EQ(state(), InstanceState::safe_mode);
}

TEST_P(InstanceWishes, WhoseColdResetNeverCameAboutStartsCold) {
  bring_up();
  ask(ControlVerb::reset_cold);
  next_manager();
  EXPECT_EQ(only_start().start_kind, StartKind::cold);
  EXPECT_TRUE(only_start().stopped);
}

TEST_P(InstanceWishes, ThatCannotBeReadStartNothing) {
  bring_up();
  stop();
  end_manager();
  wishes_.damaged = true;
  begin_next_manager();
  EXPECT_EQ(state(), InstanceState::failed);
  EXPECT_THAT(problem(), HasSubstr("checksum"));
  EXPECT_THAT(host_.spawned, IsEmpty());
  const int writes = wishes_.writes;
  EXPECT_EQ(writes, wishes_.writes);
  ask(ControlVerb::start);
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_GT(wishes_.writes, writes);
}

TEST_P(InstanceWishes, OfAnOrderlyEndAreThoseBeforeIt) {
  bring_up();
  sut().shut_down();
  sut().on_exit(exited_with(0));
  ASSERT_EQ(state(), InstanceState::offline);
  next_manager();
  EXPECT_FALSE(only_start().stopped);
  EXPECT_EQ(only_start().start_kind, StartKind::first);
  EXPECT_EQ(sut().status().restarts, 0U);
}

TEST_P(InstanceWishes, AreOnTheDiskBeforeACommandIsAnswered) {
  bring_up();
  wishes_.disk_is_slow = true;
  ask(ControlVerb::stop);
  answer();
  EXPECT_THAT(replies_, IsEmpty());
  ASSERT_EQ(wishes_.waiting.size(), 1U);
  wishes_.waiting.front()("disk full");
  const ControlReply reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::ok);
  EXPECT_EQ(reply.text, "line1: stopped; a power cut would undo it: disk full");
}

// A debugger reads its answer, and no disk knows of forces.
TEST_P(InstanceWishes, AreNotWaitedForByCommandsThatTheProcessCarriesOut) {
  bring_up();
  wishes_.disk_is_slow = true;
  wishes_.problem = "disk full";
  ask(ControlVerb::debug, "attach");
  answer(ErrorCode::ok, R"({"session":1})");
  EXPECT_EQ(take_reply().text, R"({"session":1})");
  ask(ControlVerb::force_variable, "speed=1");
  answer(ErrorCode::ok, "'speed' is forced");
  EXPECT_EQ(take_reply().text, "'speed' is forced");
  ask(ControlVerb::stop);
  answer(ErrorCode::ok, "1 halted task was let go first");
  ASSERT_EQ(wishes_.waiting.size(), 1U);
  wishes_.waiting.front()("");
  EXPECT_EQ(take_reply().text, "line1: stopped; 1 halted task was let go first");
}

TEST_P(InstanceWishes, TellOfForcesThatEndedWhileNoManagerRan) {
  if (GetParam() == Death::power_cut) return;
  bring_up();
  end_manager();
  host_.left = InstanceRuntime{};
  host_.left->forces = 2;
  begin_next_manager();
  EXPECT_THAT(problem(), HasSubstr("ended while no manager ran; 2 forces ended"));
}

INSTANTIATE_TEST_SUITE_P(Deaths, InstanceWishes, testing::Values(Death::manager_killed, Death::power_cut),
                         [](const auto& death) {
                           return death.param == Death::power_cut ? "PowerCut" : "ManagerKilled";
                         });

class AdoptedWishes : public ManagedInstanceTest {
 protected:
  void adopt_with(ApplicationState state) {
    InstanceRuntime page;
    page.pid = 77;
    page.state = state;
    page.running = state == ApplicationState::running ? 1 : 0;
    page.application.assign("/opt/line.so");
    host_.page = page;
    host_.adoptable = 77;
    make();
    ASSERT_TRUE(sut().adopt());
    if (!host_.requests.empty()) answer();
  }
};

TEST_F(AdoptedWishes, OfAStopThatWasUnderWayHold) {
  bring_up();
  ask(ControlVerb::stop);
  adopt_with(ApplicationState::running);
  EXPECT_EQ(state(), InstanceState::stopping);
  sut().on_exit(ExitStatus{.known = false});
  expire_timer();
  EXPECT_TRUE(host_.spawned.back().stopped);
}

TEST_F(AdoptedWishes, OfAStopThatHasNotReachedTheProcessAreCarriedOut) {
  bring_up();
  ask(ControlVerb::stop);
  adopt_with(ApplicationState::running);
  ASSERT_EQ(host_.requests.back().verb, ControlVerb::stop);
  EXPECT_TRUE(wishes_.wish->stopping) << "the next manager goes on with it, too";
  ask(ControlVerb::stop);  // the client repeats it
  EXPECT_EQ(host_.requests.size(), 3U) << "two stops and a status";
  ask(ControlVerb::stop);  // so does another client, and the first one is not forgotten
  EXPECT_EQ(take_reply().code, ErrorCode::busy);
  answer();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::stopped);
  EXPECT_FALSE(wishes_.wish->stopping);
}

TEST_F(AdoptedWishes, OfAStopThatIsDoneStopNoApplicationThatRunsAgain) {
  bring_up();
  ask(ControlVerb::stop);
  answer();
  take_reply();
  ask(ControlVerb::start);  // it runs, and its manager ends before it learns that
  adopt_with(ApplicationState::running);
  EXPECT_NE(host_.requests.back().verb, ControlVerb::stop);
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(AdoptedWishes, OfAnApplicationThatStoppedByItselfAreToRun) {
  bring_up();
  adopt_with(ApplicationState::exception);
  EXPECT_EQ(state(), InstanceState::exception);
  sut().on_exit(ExitStatus{.known = false});
  expire_timer();
  EXPECT_FALSE(host_.spawned.back().stopped);
}

TEST_F(AdoptedWishes, OfAResetThatWasUnderWayAreFollowedToItsEnd) {
  bring_up();
  ask(ControlVerb::reset);
  adopt_with(ApplicationState::running);
  EXPECT_EQ(state(), InstanceState::stopping);
  sut().on_exit(ExitStatus{.known = false});
  ASSERT_EQ(host_.spawned.size(), 2U);
  EXPECT_TRUE(host_.spawned.back().stopped);
}

TEST_F(AdoptedWishes, OfAProcessThatWasBeingSetUpAndIsNeverToBeStartedAgain) {
  config_.restart = RestartPolicy::never;
  make();
  sut().hold("is to be started");
  sut().release();
  make();
  ASSERT_FALSE(sut().adopt());
  sut().resume();
  EXPECT_EQ(state(), InstanceState::waiting);
  EXPECT_EQ(host_.ended_outputs, 1) << "of a process that has ended";
  expire_timer();
  EXPECT_EQ(state(), InstanceState::waiting);
  advance(kSetupLimit);
  expire_timer();
  EXPECT_EQ(state(), InstanceState::failed);
  EXPECT_EQ(host_.ended_outputs, 2) << "of the one that was waited for";
  EXPECT_EQ(host_.spawned.size(), 1U);
}

TEST_F(AdoptedWishes, ThatWereNotKnownAreThoseOfAProcessThatIsStopped) {
  wishes_.damaged = true;
  host_.adoptable = 77;
  make();
  ASSERT_TRUE(sut().adopt());
  EXPECT_EQ(wishes_.writes, 0) << "before the process has answered";
  adopt_with(ApplicationState::stopped);
  EXPECT_EQ(state(), InstanceState::stopped);
  wishes_.damaged = false;
  host_.adoptable.reset();
  make();
  ASSERT_FALSE(sut().adopt());
  sut().resume();
  expire_timer();
  ASSERT_EQ(host_.spawned.size(), 1U);
  EXPECT_TRUE(host_.spawned.back().stopped);
}

// An accepted stop holds, whatever the application did by itself before.
TEST_F(AdoptedWishes, OfAnOperatorsStopAreStrongerThanARestart) {
  bring_up();
  InstanceRuntime page;
  page.pid = sut().status().pid;
  page.state = ApplicationState::stopped;
  page.application.assign("/opt/line.so");
  host_.page = page;
  advance(kPageLag);
  sut().refresh();
  ASSERT_EQ(state(), InstanceState::stopped);
  ask(ControlVerb::stop);
  EXPECT_THAT(take_reply().text, HasSubstr("stopped already"));
  sut().on_exit(killed_by(SIGSEGV));
  expire_timer();
  EXPECT_TRUE(host_.spawned.back().stopped);
}

TEST_F(AdoptedWishes, AreWrittenOnlyWhenTheyChange) {
  bring_up();
  crash_once();
  const int writes = wishes_.writes;
  sut().refresh();
  advance(std::chrono::seconds(2));
  ask(ControlVerb::reset_statistics);
  answer();
  take_reply();
  EXPECT_EQ(wishes_.writes, writes);
}

}  // namespace
}  // namespace plchost
