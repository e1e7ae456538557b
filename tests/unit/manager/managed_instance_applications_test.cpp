#include "tests/unit/manager/managed_instance_fixture.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kFirst = "/state/000001.so";
constexpr const char* kSecond = "/state/000002.so";

class SentApplication : public ManagedInstanceTest {
 protected:
  static std::map<std::string, std::string> options(bool boot = false) {
    std::map<std::string, std::string> all{{"size", "7"}, {"sha256", std::string(64, 'a')}, {"source", "3"}};
    if (boot) all["boot"] = "yes";
    return all;
  }
  void add_version(std::uint32_t number, const std::string& path, const std::string& before) {
    ApplicationVersion& version = applications_.versions[path];
    version.number = number;
    version.path = path;
    version.name = "new.so";
    version.before = before;
  }
  /// It is kept, and the fresh process comes up with it.
  void load(std::uint32_t number, const std::string& path, const std::string& before) {
    ask(ControlVerb::download_application, "new.so", options());
    add_version(number, path, before);
    applications_.end(path);
    sut().on_exit(exited_with(0));
    report_ready();
    ASSERT_EQ(take_reply().code, ErrorCode::ok);
  }
  /// It is kept, and the host is short of something as the fresh process loads it.
  void load_while_short() {
    ask(ControlVerb::download_application, "new.so", options());
    applications_.end(std::string(kFirst));
    sut().on_exit(exited_with(0));
    sut().on_report({.step = SetupStep::load_application,
                     .code = ErrorCode::system,
                     .text = "no memory",
                     .transient = true});
    sut().on_exit(exited_with(kExitSetupFailed));
  }
};

TEST_F(SentApplication, IsKeptWithWhatWasLoadedBeforeItAndThenLoaded) {
  bring_up();
  ask(ControlVerb::download_application, "new.so", options());
  ASSERT_EQ(applications_.kept.size(), 1U);
  EXPECT_EQ(applications_.kept[0].name, "new.so");
  EXPECT_EQ(applications_.kept[0].order.size, 7U);
  EXPECT_EQ(applications_.kept[0].order.source, 3U);
  EXPECT_EQ(applications_.kept[0].loaded.now, "/opt/line.so");
  EXPECT_EQ(applications_.kept[0].loaded.earlier, "");
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_THAT(host_.requests, IsEmpty());
  add_version(1, kFirst, "/opt/line.so");
  applications_.end(std::string(kFirst));
  sut().on_exit(exited_with(0));
  EXPECT_EQ(host_.spawned.back().application, kFirst);
  report_ready();
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::ok);
  EXPECT_THAT(reply.text, HasSubstr("version 1 (new.so)"));
  EXPECT_THAT(applications_.booted, IsEmpty());
}

TEST_F(SentApplication, ThatIsRefusedDisturbsNothing) {
  bring_up();
  ask(ControlVerb::download_application, "new.so", options(/*boot=*/true));
  applications_.end(failure(ErrorCode::invalid_argument, "new.so is refused: not an ELF file"));
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::invalid_argument);
  EXPECT_EQ(reply.text, "new.so is refused: not an ELF file");
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_THAT(host_.requests, IsEmpty());
  EXPECT_THAT(applications_.booted, IsEmpty());
  EXPECT_EQ(sut().status().application.view(), "/opt/line.so");
}

TEST_F(SentApplication, ThatCannotBeStoredIsToldAtOnce) {
  bring_up();
  applications_.can_start = false;
  ask(ControlVerb::download_application, "new.so", options());
  EXPECT_EQ(take_reply().code, ErrorCode::system);
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(SentApplication, WithoutItsSizeOrDigestIsRefused) {
  bring_up();
  for (const char* missing : {"size", "sha256"}) {
    auto left = options();
    left.erase(missing);
    ask(ControlVerb::download_application, "new.so", left);
    const auto reply = take_reply();
    EXPECT_EQ(reply.code, ErrorCode::invalid_argument);
    EXPECT_THAT(reply.text, HasSubstr(missing));
  }
  EXPECT_THAT(applications_.kept, IsEmpty());
}

TEST_F(SentApplication, WithTheNameOfAFolderIsRefused) {
  bring_up();
  ask(ControlVerb::download_application, "../new.so", options());
  EXPECT_EQ(take_reply().code, ErrorCode::invalid_argument);
}

TEST_F(SentApplication, OutlivesACrashWhileItIsStored) {
  bring_up();
  ask(ControlVerb::download_application, "new.so", options());
  sut().on_exit(killed_by(SIGSEGV));
  EXPECT_THAT(replies_, IsEmpty());
  applications_.end(std::string(kFirst));
  EXPECT_EQ(host_.spawned.back().application, kFirst);
  report_ready();
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
}

TEST_F(SentApplication, IsTheOnlyThingThatAnInstanceDoes) {
  bring_up();
  ask(ControlVerb::download_application, "new.so", options());
  ask(ControlVerb::stop);
  EXPECT_EQ(take_reply().code, ErrorCode::busy);
}

TEST_F(SentApplication, IsForgottenWhenTheManagerEndsMeanwhile) {
  bring_up();
  ask(ControlVerb::download_application, "new.so", options());
  sut().shut_down();
  EXPECT_EQ(take_reply().code, ErrorCode::unavailable);
  applications_.end(std::string(kFirst));
  EXPECT_EQ(sut().status().application.view(), "/opt/line.so");
}

TEST_F(SentApplication, BecomesTheBootApplicationOnlyWhenItIsUp) {
  bring_up();
  ask(ControlVerb::download_application, "new.so", options(/*boot=*/true));
  applications_.end(std::string(kFirst));
  sut().on_exit(exited_with(0));
  EXPECT_THAT(applications_.booted, IsEmpty());
  report_ready();
  EXPECT_THAT(applications_.booted, ElementsAre(kFirst));
  EXPECT_THAT(replies_, IsEmpty());
  applications_.end(std::string(kFirst));
  EXPECT_EQ(take_reply().code, ErrorCode::ok);
}

TEST_F(SentApplication, ThatDoesNotComeUpIsNoBootApplication) {
  bring_up();
  ask(ControlVerb::download_application, "new.so", options(/*boot=*/true));
  applications_.end(std::string(kFirst));
  sut().on_exit(exited_with(0));
  sut().on_exit(killed_by(SIGSEGV));
  report_ready();  // the one before
  EXPECT_EQ(take_reply().code, ErrorCode::unavailable);
  EXPECT_THAT(applications_.booted, IsEmpty());
}

TEST_F(SentApplication, ThatDoesNotComeUpMakesRoomForTheOneBefore) {
  bring_up();
  ask(ControlVerb::download_application, "new.so", options());
  applications_.end(std::string(kFirst));
  sut().on_exit(exited_with(0));
  sut().on_report(
      {.step = SetupStep::load_application, .code = ErrorCode::wrong_size, .text = "io.in is larger"});
  sut().on_exit(exited_with(kExitSetupFailed));
  EXPECT_THAT(replies_, IsEmpty());
  ASSERT_EQ(host_.spawned.size(), 3U);
  EXPECT_EQ(host_.spawned.back().application, "/opt/line.so");
  EXPECT_FALSE(host_.spawned.back().stopped);
  report_ready();
  const ControlReply reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::unavailable);
  EXPECT_THAT(reply.text, HasSubstr("io.in is larger"));
  EXPECT_THAT(reply.text, HasSubstr("/opt/line.so, which was loaded before, is started again"));
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(wishes_.wish->application, "/opt/line.so");
  EXPECT_TRUE(wishes_.wish->crashes_unix_ns.empty());
}

// The other writer may go away, so the start is tried again where there is nothing to take back.
TEST_F(SentApplication, WhoseOutputsHaveAnotherWriterMakesRoomForTheOneBefore) {
  const SetupReport taken{.step = SetupStep::load_application,
                          .code = ErrorCode::busy,
                          .text = "io.out has a writer already",
                          .transient = true};
  bring_up();
  ask(ControlVerb::download_application, "new.so", options());
  applications_.end(std::string(kFirst));
  sut().on_exit(exited_with(0));
  sut().on_report(taken);
  sut().on_exit(exited_with(kExitSetupFailed));
  ASSERT_EQ(host_.spawned.size(), 3U);
  EXPECT_EQ(host_.spawned.back().application, "/opt/line.so");
  sut().on_report(taken);
  sut().on_exit(exited_with(kExitSetupFailed));
  EXPECT_EQ(state(), InstanceState::waiting);
  EXPECT_EQ(take_reply().code, ErrorCode::unavailable);
  expire_timer();
  EXPECT_EQ(host_.spawned.back().application, "/opt/line.so");
  report_ready();
  EXPECT_EQ(state(), InstanceState::running);
}

TEST_F(SentApplication, IsTriedAgainWhereTheHostIsShortOfSomething) {
  bring_up();
  load_while_short();
  EXPECT_EQ(state(), InstanceState::waiting);
  expire_timer();
  EXPECT_EQ(host_.spawned.back().application, kFirst);
}

// A third one is sent before the second one was up: the store must not remove the first one for it.
TEST_F(SentApplication, LeavesTheOneThatRanInTheStoreUntilANewerOneIsUp) {
  bring_up();
  load_while_short();
  ASSERT_EQ(state(), InstanceState::waiting);
  (void)take_reply();
  ask(ControlVerb::download_application, "newer.so", options());
  ASSERT_EQ(applications_.kept.size(), 2U);
  EXPECT_EQ(applications_.kept[1].loaded.now, kFirst);
  EXPECT_EQ(applications_.kept[1].loaded.earlier, "/opt/line.so");
}

TEST_F(SentApplication, ThatDoesNotComeUpLeavesAStoppedMachineStopped) {
  bring_up_stopped();
  ask(ControlVerb::load_application, "/opt/new.so");
  sut().on_application_checked({});
  sut().on_exit(exited_with(0));
  sut().on_exit(killed_by(SIGSEGV));
  EXPECT_EQ(host_.spawned.back().application, "/opt/line.so");
  EXPECT_TRUE(host_.spawned.back().stopped);
}

TEST_F(SentApplication, ThatDoesNotComeUpFailsWhereTheOneBeforeDoesNotEither) {
  bring_up();
  ask(ControlVerb::load_application, "/opt/new.so");
  sut().on_application_checked({});
  sut().on_exit(exited_with(0));
  sut().on_exit(exited_with(kExitSetupFailed));
  sut().on_exit(exited_with(kExitSetupFailed));
  EXPECT_EQ(take_reply().code, ErrorCode::unavailable);
  EXPECT_EQ(state(), InstanceState::failed);
  EXPECT_EQ(host_.spawned.size(), 3U);
}

TEST_F(SentApplication, TellsWhenItIsLoadedAndCouldNotBecomeTheBootApplication) {
  bring_up();
  ask(ControlVerb::load_application, "/opt/new.so", {{"boot", "yes"}});
  sut().on_application_checked({});
  sut().on_exit(exited_with(0));
  report_ready();
  EXPECT_THAT(applications_.booted, ElementsAre("/opt/new.so"));
  applications_.end(failure(ErrorCode::system, "write /state/boot"));
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::system);
  EXPECT_THAT(reply.text, HasSubstr("it is loaded, but not the boot application"));
}

TEST_F(SentApplication, GoesBackOneVersionWithEachRollback) {
  bring_up();
  load(1, kFirst, "/opt/line.so");
  load(2, kSecond, kFirst);
  for (const char* path : {kFirst, "/opt/line.so"}) {
    ask(ControlVerb::rollback_application);
    EXPECT_EQ(host_.checked.back(), path);
    sut().on_application_checked({});
    sut().on_exit(exited_with(0));
    EXPECT_EQ(host_.spawned.back().application, path);
    report_ready();
    EXPECT_EQ(take_reply().code, ErrorCode::ok);
  }
  ask(ControlVerb::rollback_application);
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::wrong_state);
  EXPECT_THAT(reply.text, HasSubstr("/opt/line.so was not sent to 'line1'"));
}

TEST_F(SentApplication, ThatWasTheFirstOneOfAllHasNoneBeforeIt) {
  config_.application.clear();
  make();
  bring_up_stopped();
  load(1, kFirst, "");
  ask(ControlVerb::rollback_application);
  EXPECT_EQ(take_reply().code, ErrorCode::not_found);
}

TEST_F(SentApplication, ThatIsGoneIsNotRolledBackTo) {
  bring_up();
  load(1, kFirst, "/opt/line.so");
  ask(ControlVerb::rollback_application);
  sut().on_application_checked(failure(ErrorCode::invalid_argument, "cannot be opened"));
  const auto reply = take_reply();
  EXPECT_EQ(reply.text, "/opt/line.so is refused: cannot be opened");
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(sut().status().application.view(), kFirst);
}

TEST_F(SentApplication, OfTheBootFolderIsWhatTheFirstProcessBeginsWith) {
  applications_.boot_path = kSecond;
  make();
  EXPECT_EQ(sut().status().application.view(), kSecond);
  bring_up();
  EXPECT_EQ(host_.spawned.back().application, kSecond);
}

TEST_F(SentApplication, IsNotTakenForSafeModeWhenItsProcessIsAdopted) {
  config_.application.clear();
  applications_.boot_path = kSecond;
  make();
  host_.adoptable = 4711;
  InstanceRuntime runtime;
  runtime.pid = 4711;
  runtime.running = 1;
  runtime.state = ApplicationState::running;
  runtime.application.assign(kFirst);
  host_.page = runtime;
  ASSERT_TRUE(sut().adopt());
  answer();
  EXPECT_EQ(state(), InstanceState::running);
  EXPECT_EQ(sut().status().application.view(), kFirst);
}

// --- online

class OnlineApplication : public SentApplication {
 protected:
  const std::map<std::string, std::string> online_{{"online", "yes"}};
  void change(const ControlReply& answer) {
    ask(ControlVerb::load_application, "/opt/new.so", online_);
    sut().on_application_checked({});
    ASSERT_EQ(host_.requests.size(), 1U);
    EXPECT_EQ(host_.requests.back().verb, ControlVerb::change_application);
    EXPECT_EQ(host_.requests.back().argument, "/opt/new.so");
    ControlReply numbered = answer;
    numbered.number = host_.requests.back().number;
    sut().on_reply(numbered);
  }
};

TEST_F(OnlineApplication, IsTriedFirstAndThenTakenInByTheProcessThatIsUp) {
  bring_up();
  change({.number = 0, .code = ErrorCode::ok, .text = "taken over"});
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::ok);
  EXPECT_EQ(reply.text, "taken over");
  EXPECT_THAT(host_.checked, ElementsAre("/opt/new.so"));
  EXPECT_EQ(host_.spawned.size(), 1U) << "no fresh process";
  EXPECT_EQ(sut().status().application.view(), "/opt/new.so");
  EXPECT_EQ(state(), InstanceState::running);
  sut().on_exit(killed_by(SIGSEGV));
  expire_timer();
  EXPECT_EQ(host_.spawned.back().application, "/opt/new.so") << "the start after a crash";
}

TEST_F(OnlineApplication, ThatDoesNotFitChangesNothing) {
  bring_up();
  change({.number = 0, .code = ErrorCode::refused, .text = "task 'Main' is gone"});
  const auto reply = take_reply();
  EXPECT_EQ(reply.code, ErrorCode::refused);
  EXPECT_EQ(reply.text, "task 'Main' is gone");
  EXPECT_EQ(sut().status().application.view(), "/opt/line.so");
  sut().on_exit(killed_by(SIGSEGV));
  expire_timer();
  EXPECT_EQ(host_.spawned.back().application, "/opt/line.so");
}

TEST_F(OnlineApplication, ThatIsWrongDoesNotReachTheProcess) {
  bring_up();
  ask(ControlVerb::load_application, "/opt/new.so", online_);
  sut().on_application_checked(failure(ErrorCode::invalid_argument, "killed by SIGSEGV"));
  EXPECT_EQ(take_reply().code, ErrorCode::invalid_argument);
  EXPECT_THAT(host_.requests, IsEmpty());
}

TEST_F(OnlineApplication, NeedsAProcessWithAnApplication) {
  ask(ControlVerb::load_application, "/opt/new.so", online_);
  const auto offline = take_reply();
  EXPECT_EQ(offline.code, ErrorCode::wrong_state);
  EXPECT_THAT(offline.text, HasSubstr("'line1' is offline"));
  EXPECT_THAT(offline.text, HasSubstr("load it without --online"));
  EXPECT_THAT(host_.checked, IsEmpty());
  EXPECT_EQ(sut().status().application.view(), "/opt/line.so");
  reach_safe_mode();
  ask(ControlVerb::load_application, "/opt/new.so", online_);
  EXPECT_THAT(take_reply().text, HasSubstr("'line1' is safe mode"));
}

TEST_F(OnlineApplication, FindsThatTheProcessHasEndedWhileItWasTried) {
  bring_up();
  ask(ControlVerb::load_application, "/opt/new.so", online_);
  sut().on_exit(killed_by(SIGSEGV));
  sut().on_application_checked({});
  EXPECT_EQ(take_reply().code, ErrorCode::wrong_state);
  expire_timer();
  EXPECT_EQ(host_.spawned.back().application, "/opt/line.so");
}

TEST_F(OnlineApplication, ThatEndsTheProcessIsNotWhatComesAfter) {
  bring_up();
  ask(ControlVerb::load_application, "/opt/new.so", online_);
  sut().on_application_checked({});
  sut().on_exit(killed_by(SIGSEGV));
  EXPECT_EQ(take_reply().code, ErrorCode::unavailable);
  expire_timer();
  EXPECT_EQ(host_.spawned.back().application, "/opt/line.so");
}

TEST_F(OnlineApplication, MayBeSentAndBecomesTheBootApplicationWhenItHasTakenOver) {
  bring_up();
  auto all = options(/*boot=*/true);
  all["online"] = "yes";
  ask(ControlVerb::download_application, "new.so", all);
  add_version(1, kFirst, "/opt/line.so");
  applications_.end(std::string(kFirst));
  ASSERT_EQ(host_.requests.size(), 1U);
  EXPECT_EQ(host_.requests.back().argument, kFirst);
  EXPECT_THAT(applications_.booted, IsEmpty());
  sut().on_reply({.number = host_.requests.back().number, .code = ErrorCode::ok, .text = "taken over"});
  ASSERT_THAT(applications_.booted, ElementsAre(kFirst));
  applications_.end(std::string(kFirst));
  EXPECT_EQ(take_reply().text, "version 1 (new.so) is loaded, taken over");
}

}  // namespace
}  // namespace plchost
