// The fate of an instance when the configuration is read again.

#include <string>

#include "tests/unit/manager/managed_instance_fixture.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

class ManagedInstanceReload : public ManagedInstanceTest {
 protected:
  /// The next manager; its processes are `adoptable`.
  void next_manager() {
    make();
    if (!sut().adopt()) return sut().resume();
    host_.page = InstanceRuntime{};
    host_.page->pid = *host_.adoptable;
    host_.page->running = 1;
    host_.page->state = ApplicationState::running;
    host_.page->application.assign("/opt/line.so");
    answer();
  }
};

TEST_F(ManagedInstanceReload, UsesTheChangedPolicyAtOnce) {
  bring_up();
  config_.restart = RestartPolicy::never;
  sut().reconfigure(config_);
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(problem(), "");
  sut().on_exit(killed_by(SIGSEGV));
  EXPECT_EQ(state(), InstanceState::failed);
}

// The manager before ended in its set-up.
TEST_F(ManagedInstanceReload, NoLongerWaitsForAnEarlierProcessWhenOneWasStarted) {
  config_.restart = RestartPolicy::never;
  make();
  sut().hold("is to be started");
  sut().release();
  next_manager();
  ASSERT_EQ(state(), InstanceState::waiting);
  ask(ControlVerb::start);
  report_ready();
  ASSERT_EQ(state(), InstanceState::running);
  config_.restart = RestartPolicy::always;
  sut().reconfigure(config_);
  crash_once();
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(host_.spawned.size(), 3U);
}

TEST_F(ManagedInstanceReload, UsesTheRestFromTheNextProcessOn) {
  bring_up();
  config_.application = "/opt/other.so";
  config_.scheduler = "CmpScheduleTimer";
  config_.settings = "/etc/other.cfg";
  sut().reconfigure(config_);
  EXPECT_EQ(sut().status().application.view(), "/opt/line.so");
  EXPECT_THAT(problem(), HasSubstr("the configuration has changed: application, scheduler, core, priority"));
  crash_once();
  EXPECT_EQ(host_.spawned.back().application, "/opt/other.so");
  EXPECT_EQ(host_.spawned.back().scheduler, "CmpScheduleTimer");
  EXPECT_EQ(host_.spawned.back().settings, "/etc/other.cfg");
  EXPECT_EQ(sut().awaited_changes(), "");
}

TEST_F(ManagedInstanceReload, LetsNoDebuggerHaltTasksOnceTheHostAllowsNoDebugBuilds) {
  bring_up();
  host_config_.allow_debug = false;
  for (const char* const command :
       {"attach", "attach take", "7 break Main:3", "7 pause *", "7 step Main", "7 next Main", "7 out Main",
        "7 until Main Main:4", "7 halts all", "7 local Main 0 n=1", "7", ""}) {
    ask(ControlVerb::debug, command);
    const auto reply = take_reply();
    EXPECT_EQ(reply.code, ErrorCode::refused) << command;
    EXPECT_THAT(reply.text, HasSubstr("this host says allow_debug = false")) << command;
  }
  EXPECT_TRUE(host_.requests.empty());
  for (const char* const command : {"7 continue *", "7 delete 1", "7 detach"}) {
    ask(ControlVerb::debug, command);
    answer();
    EXPECT_EQ(take_reply().code, ErrorCode::ok) << command;
  }
  host_config_.allow_debug = true;
  ask(ControlVerb::debug, "attach");
  answer();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  crash_once();
  EXPECT_FALSE(host_.spawned.back().no_debug);
}

TEST_F(ManagedInstanceReload, PutsAYoungerCommandBeforeTheConfiguration) {
  bring_up();
  config_.application = "/opt/other.so";
  config_.scheduler = "CmpScheduleTimer";
  sut().reconfigure(config_);
  ask(ControlVerb::set_scheduler, "CmpSchedule");
  answer();
  take_reply();
  ask(ControlVerb::load_application, "/opt/loaded.so");
  sut().on_application_checked({});
  sut().on_exit(exited_with(0));
  report_ready();
  take_reply();
  EXPECT_EQ(host_.spawned.back().application, "/opt/loaded.so");
  EXPECT_EQ(host_.spawned.back().scheduler, "CmpSchedule");
  EXPECT_EQ(sut().awaited_changes(), "");
}

TEST_F(ManagedInstanceReload, KeepsWhatWaitsOverTheEndOfTheManager) {
  bring_up();
  config_.application = "/opt/other.so";
  sut().reconfigure(config_);
  host_.adoptable = 100;
  for (int manager = 0; manager < 2; ++manager) {
    next_manager();
    EXPECT_EQ(sut().status().application.view(), "/opt/line.so");
    EXPECT_THAT(sut().awaited_changes(), HasSubstr("application"));
  }
  crash_once();
  EXPECT_EQ(host_.spawned.back().application, "/opt/other.so");
}

TEST_F(ManagedInstanceReload, StartsWhatFailedAndIsMended) {
  bring_up();
  config_.restart = RestartPolicy::never;
  sut().reconfigure(config_);
  sut().on_exit(killed_by(SIGSEGV));
  ASSERT_EQ(state(), InstanceState::failed);
  config_.crash_limit = 8;
  sut().reconfigure(config_);
  EXPECT_EQ(state(), InstanceState::failed) << "that mends nothing";
  config_.settings = "/etc/other.cfg";
  sut().reconfigure(config_);
  EXPECT_TRUE(sut().held());
}

TEST_F(ManagedInstanceReload, DoesNotStartWhatAnOperatorStopped) {
  bring_up_stopped();
  sut().remove();
  sut().on_exit(exited_with(0));
  EXPECT_TRUE(sut().gone());
  config_.application = "/opt/other.so";
  sut().reconfigure(config_);
  EXPECT_FALSE(sut().held());
  EXPECT_EQ(state(), InstanceState::offline);
  EXPECT_EQ(sut().status().application.view(), "/opt/other.so");
}

TEST_F(ManagedInstanceReload, DoesNotTryARemovedInstanceAgain) {
  bring_up();
  sut().on_exit(killed_by(SIGSEGV));
  ASSERT_EQ(state(), InstanceState::waiting);
  sut().remove();
  EXPECT_EQ(state(), InstanceState::offline);
  EXPECT_TRUE(sut().gone());
  EXPECT_FALSE(host_.timer);
}

TEST_F(ManagedInstanceReload, LetsACommandOfARemovedInstanceComeToItsEnd) {
  bring_up();
  ask(ControlVerb::restart);
  sut().remove();
  sut().on_exit(exited_with(0));
  EXPECT_EQ(host_.spawned.size(), 2U);
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_FALSE(sut().gone());
  ask(ControlVerb::stop);
  EXPECT_EQ(host_.requests.back().verb, ControlVerb::shutdown);
  sut().on_exit(exited_with(0));
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_TRUE(sut().gone());
}

TEST_F(ManagedInstanceReload, RefusesWhatWasBeingTriedWhenItWasRemoved) {
  bring_up();
  ask(ControlVerb::load_application, "/opt/loaded.so");
  sut().remove();
  sut().on_application_checked({});
  EXPECT_EQ(take_reply().code, ErrorCode::wrong_state);
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(host_.spawned.size(), 1U);
}

}  // namespace
}  // namespace plchost
