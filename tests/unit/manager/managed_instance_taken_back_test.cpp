// A load that fails after its trial: the application before runs again, with the settings that it had.

#include "tests/unit/manager/managed_instance_fixture.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class TakenBack : public ManagedInstanceTest {
 protected:
  /// Another application has passed its trial, and its process begins.
  void begin_load(const std::map<std::string, std::string>& options = {}) {
    ask(ControlVerb::load_application, "/opt/new.so", options);
    sut().on_application_checked({});
    sut().on_exit(exited_with(0));
  }
  /// The process of another application has failed, and the one before runs again.
  void take_back() {
    begin_load();
    sut().on_exit(exited_with(kExitSetupFailed));
    report_ready();
    EXPECT_EQ(take_reply().code, ErrorCode::unavailable);
  }
};

TEST_F(TakenBack, AfterAFailureInAnyStepOfTheStart) {
  using enum SetupStep;
  for (const SetupStep step :
       {bind_core, lock_memory, read_settings, attach_pool, open_control_socket, load_components,
        load_application, make_status_page, make_tasks, start_scheduler}) {
    for (const ErrorCode code : {ErrorCode::refused, ErrorCode::busy, ErrorCode::full}) {
      host_ = FakeHost();
      wishes_ = FakeWishes();
      make();
      bring_up();
      begin_load();
      EXPECT_FALSE(host_.spawned.back().kept_settings);
      sut().on_report({.step = step, .code = code, .text = "something is taken"});
      sut().on_exit(exited_with(kExitSetupFailed));
      ASSERT_EQ(host_.spawned.size(), 3U) << to_string(step);
      EXPECT_EQ(host_.spawned.back().application, "/opt/line.so");
      EXPECT_TRUE(host_.spawned.back().kept_settings) << "the new settings may be why";
      report_ready();
      const ControlReply reply = take_reply();
      EXPECT_EQ(reply.code, ErrorCode::unavailable);
      EXPECT_THAT(reply.text, HasSubstr("/opt/new.so does not come up: "));
      EXPECT_THAT(reply.text, HasSubstr("something is taken"));
      EXPECT_EQ(state(), InstanceState::running);
      EXPECT_THAT(problem(), HasSubstr("/opt/new.so does not come up: "));
    }
  }
}

// Its first start met something that passes, and its second one did not.
TEST_F(TakenBack, AlsoAfterABackOff) {
  const SetupReport short_of_memory{
      .step = SetupStep::load_application, .code = ErrorCode::system, .text = "ENOMEM", .transient = true};
  const SetupReport name_taken{
      .step = SetupStep::attach_pool, .code = ErrorCode::already_exists, .text = "it runs already"};
  for (const SetupReport& first : {short_of_memory, name_taken}) {
    host_ = FakeHost();
    wishes_ = FakeWishes();
    make();
    bring_up();
    begin_load();
    sut().on_report(first);
    sut().on_exit(exited_with(kExitSetupFailed));
    EXPECT_EQ(take_reply().code, ErrorCode::unavailable);
    EXPECT_EQ(wishes_.wish->application_before, "/opt/line.so");
    expire_timer();
    EXPECT_EQ(host_.spawned.back().application, "/opt/new.so");
    sut().on_exit(exited_with(kExitSetupFailed));
    EXPECT_EQ(host_.spawned.back().application, "/opt/line.so");
    report_ready();
    EXPECT_EQ(state(), InstanceState::running);
    EXPECT_THAT(problem(), HasSubstr("/opt/new.so does not come up"));
    EXPECT_THAT(replies_, IsEmpty());
  }
}

// Where the limits of the instance do not let the process up, no later start will do better.
TEST_F(TakenBack, WhereItNeedsMoreThreadsThanTheInstanceMayHave) {
  bring_up();
  begin_load();
  host_.met_pids_max = true;
  sut().on_report(
      {.step = SetupStep::make_tasks, .code = ErrorCode::system, .text = "EAGAIN", .transient = true});
  sut().on_exit(exited_with(kExitSetupFailed));
  ASSERT_EQ(host_.spawned.size(), 3U);
  EXPECT_EQ(host_.spawned.back().application, "/opt/line.so");
  report_ready();
  EXPECT_THAT(take_reply().text, HasSubstr("EAGAIN; it needs more threads and processes than its pids_max"));
  EXPECT_EQ(state(), InstanceState::running);
}

// The settings file that the configuration names now counts, and the client hears of the failure all the
// same.
TEST_F(TakenBack, IsToldAlsoWhereTheConfigurationChangesMeanwhile) {
  bring_up();
  begin_load({{"boot", "yes"}});
  InstanceConfig changed = config_;
  changed.settings = "/etc/plchost/other.cfg";
  sut().reconfigure(changed);
  sut().on_exit(exited_with(kExitSetupFailed));
  EXPECT_EQ(host_.spawned.back().application, "/opt/line.so");
  EXPECT_FALSE(host_.spawned.back().kept_settings);
  report_ready();
  const ControlReply reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::unavailable);
  EXPECT_THAT(reply.text, HasSubstr("/opt/new.so does not come up"));
}

TEST_F(TakenBack, NotAfterItCameUpOnce) {
  bring_up();
  begin_load();
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  sut().on_exit(killed_by(SIGSEGV));
  expire_timer();
  sut().on_exit(exited_with(kExitSetupFailed));
  EXPECT_EQ(state(), InstanceState::failed);
  EXPECT_EQ(wishes_.wish->application, "/opt/new.so");
}

TEST_F(TakenBack, WithTheSettingsOfThenUntilAnOperatorsNextStart) {
  bring_up();
  take_back();
  crash_once();
  EXPECT_TRUE(host_.spawned.back().kept_settings) << "nobody has mended the file since";
  ask(ControlVerb::load_application, "/opt/new.so");
  EXPECT_FALSE(host_.launch_checked.kept_settings) << "a trial is one of the next settings";
  sut().on_application_checked(failure(ErrorCode::refused, "no"));
  take_reply();
  make();  // another manager
  EXPECT_THAT(wishes_.wish->taken_back, HasSubstr("/opt/new.so does not come up"));
  sut().resume();
  sut().release();
  expire_timer();
  EXPECT_TRUE(host_.spawned.back().kept_settings);
  report_ready();
  ask(ControlVerb::restart);
  sut().on_exit(exited_with(0));
  EXPECT_FALSE(host_.spawned.back().kept_settings);
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(problem(), "");
}

TEST_F(TakenBack, IsOverWhenAnotherOneTakesOverOnline) {
  bring_up();
  take_back();
  ask(ControlVerb::load_application, "/opt/third.so", {{"online", "yes"}});
  sut().on_application_checked({});
  answer();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
  EXPECT_EQ(problem(), "");
  EXPECT_EQ(wishes_.wish->taken_back, "");
  crash_once();
  EXPECT_FALSE(host_.spawned.back().kept_settings);
}

}  // namespace
}  // namespace plchost
