// A configuration that is changed while instances run, and read again.

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "instances/launch/launch_contract.hpp"
#include "tests/integration/manager/costs_cycles.hpp"
#include "tests/integration/manager/reload_fixture.hpp"
#include "tests/support/receive_until.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST_F(Reload, SaysSoWhenNothingHasChanged) {
  start();
  EXPECT_EQ(reload().text, "nothing has changed");
  expect_undisturbed("line1", line1_);
  expect_nothing_left();
}

TEST_F(Reload, CostsNoCycleOfAnInstanceThatIsUnchanged) {
  start();
  EXPECT_FALSE(costs_cycles(plant_, "drive1", [&](std::uint32_t round) {
    plant_.add(fmt::format("spare{}", round), "packer", "autostart = false");
    EXPECT_EQ(reload().code, ErrorCode::ok);
  }));
  expect_undisturbed("drive1", drive1_);
}

TEST_F(Reload, StartsWhatIsNewAndLeavesTheOthersAlone) {
  start();
  plant_.add("packer1", "packer", "after = [\"line1\"]");
  plant_.add("spare", "packer", "autostart = false");
  const auto reply = reload();
  EXPECT_EQ(reply.code, ErrorCode::ok);
  EXPECT_EQ(reply.text, "instance 'packer1': new\ninstance 'spare': new");
  ASSERT_TRUE(plant_.wait_for("packer1", InstanceState::running));
  EXPECT_TRUE(is_listed("spare"));
  EXPECT_EQ(plant_.status("spare").pid, 0);
  expect_undisturbed("line1", line1_);
  expect_undisturbed("drive1", drive1_);
  EXPECT_EQ(plant_.ask(ControlVerb::start, "spare").code, ErrorCode::ok);
  expect_nothing_left();
}

TEST_F(Reload, LetsARemovedInstanceRunUntilItIsStopped) {
  start();
  remove_drive1();
  expect_undisturbed("drive1", drive1_);
  EXPECT_EQ(plant_.status("drive1").removed, 1U);
  EXPECT_THAT(std::string(plant_.status("drive1").problem.view()),
              HasSubstr("removed from the configuration"));
  for (const ControlVerb verb : {ControlVerb::restart, ControlVerb::reset, ControlVerb::start}) {
    const auto refused = plant_.ask(verb, "drive1");
    EXPECT_EQ(refused.code, ErrorCode::wrong_state);
    EXPECT_THAT(refused.text, HasSubstr("removed from the configuration"));
  }
  const auto stopped = plant_.ask(ControlVerb::stop, "drive1");
  EXPECT_EQ(stopped.code, ErrorCode::ok) << stopped.text;
  EXPECT_TRUE(disappears("drive1"));
  EXPECT_EQ(plant_.ask(ControlVerb::start, "drive1").code, ErrorCode::not_found);
  expect_undisturbed("line1", line1_);
  expect_nothing_left();
}

TEST_F(Reload, DoesNotRestartARemovedInstanceThatCrashes) {
  start();
  const std::string settings = kept_settings_path(plant_.run_directory(), "drive1");
  EXPECT_TRUE(Plant::eventually([&] { return std::filesystem::exists(settings); }));
  remove_drive1();
  auto process = open_process(drive1_);
  ASSERT_TRUE(process);
  ASSERT_TRUE(signal_process(*process, SIGKILL));
  EXPECT_TRUE(disappears("drive1"));
  const auto pages = InstancePageReader::open(plant_.pool(), "drive1");
  EXPECT_FALSE(pages) << "its page is removed with it";
  EXPECT_FALSE(std::filesystem::exists(settings)) << "they are those of no process any more";
  expect_nothing_left();
}

TEST_F(Reload, EndsARemovedInstanceWhoseApplicationDoesNotRun) {
  start();
  ASSERT_EQ(plant_.ask(ControlVerb::stop, "drive1").code, ErrorCode::ok);
  plant_.clear_instances();
  plant_.add("line1", "bottling_line");
  EXPECT_EQ(reload().text, "instance 'drive1': removed; its process ends");
  EXPECT_TRUE(disappears("drive1"));
  // It was stopped when it went, so it is stopped when it is back.
  plant_.add("drive1", "drive_axis");
  EXPECT_EQ(reload().text, "instance 'drive1': new");
  EXPECT_FALSE(Plant::within(std::chrono::seconds(1), [&] { return plant_.status("drive1").pid != 0; }));
  EXPECT_EQ(plant_.ask(ControlVerb::start, "drive1").code, ErrorCode::ok);
  EXPECT_TRUE(plant_.wait_for("drive1", InstanceState::running));
  expect_nothing_left();
}

TEST_F(Reload, TakesARemovedInstanceBack) {
  start();
  remove_drive1();
  plant_.add("drive1", "drive_axis");
  EXPECT_EQ(reload().text, "instance 'drive1': in the configuration again");
  expect_undisturbed("drive1", drive1_);
  EXPECT_EQ(plant_.status("drive1").removed, 0U);
  EXPECT_TRUE(plant_.status("drive1").problem.view().empty()) << plant_.status("drive1").problem.view();
  EXPECT_EQ(plant_.ask(ControlVerb::restart, "drive1").code, ErrorCode::ok);
  expect_nothing_left();
}

TEST_F(Reload, LeavesWhatNeedsARestartForIt) {
  start();
  plant_.write_file("drive1.cfg", "[CmpSchedule]\nSchedulerInterval=2000\n");
  plant_.clear_instances();
  plant_.add("line1", "bottling_line", "crash_limit = 9\nautostart = false");
  plant_.add("drive1", "packer", "settings = \"drive1.cfg\"\nscheduler = \"CmpScheduleTimer\"");
  const auto reply = reload();
  EXPECT_EQ(reply.code, ErrorCode::ok) << reply.text;
  EXPECT_EQ(
      reply.text,
      "instance 'line1': crash_limit changed, used at once\n"
      "instance 'line1': autostart changed, used when the host starts the next time; until then start and "
      "stop decide\n"
      "instance 'drive1': scheduler, settings, application changed, used from the next start or restart "
      "of the instance");
  expect_undisturbed("line1", line1_);
  expect_undisturbed("drive1", drive1_);
  EXPECT_THAT(std::string(plant_.status("drive1").application.view()), HasSubstr("drive_axis"));
  EXPECT_THAT(std::string(plant_.status("drive1").problem.view()),
              HasSubstr("the configuration has changed"));
  EXPECT_EQ(reload().text, "nothing has changed");
  EXPECT_EQ(plant_.ask(ControlVerb::restart, "drive1").code, ErrorCode::ok);
  EXPECT_THAT(std::string(plant_.status("drive1").application.view()), HasSubstr("packer"));
  EXPECT_EQ(plant_.status("drive1").scheduler.view(), "CmpScheduleTimer");
  EXPECT_TRUE(plant_.status("drive1").problem.view().empty()) << plant_.status("drive1").problem.view();
  expect_nothing_left();
}

TEST_F(Reload, ChangesNothingWhenTheFileIsFaulty) {
  start();
  plant_.add("packer1", "packer", "restart = \"sometimes\"");
  const auto reply = reload();
  EXPECT_EQ(reply.code, ErrorCode::invalid_argument);
  EXPECT_THAT(reply.text, AllOf(HasSubstr("cell.toml:"), HasSubstr("restart"), HasSubstr("on-failure")));
  EXPECT_FALSE(is_listed("packer1"));
  plant_.write_configuration("[host\n");
  EXPECT_THAT(plant_.ask(ControlVerb::reload_host, "").text, HasSubstr("cell.toml:1"));
  expect_undisturbed("line1", line1_);
  expect_undisturbed("drive1", drive1_);
  expect_nothing_left();
}

// The findings of --check-config, and not only those of the file by itself.
TEST_F(Reload, ChangesNothingWhenAnApplicationIsNone) {
  start();
  plant_.write_file("lamp.so", "no shared object");
  plant_.write_configuration(
      plant_.configuration() +
      "[[instance]]\nname = \"lamp\"\ncore = 0\nshare_core = true\napplication = \"lamp.so\"\n");
  const auto reply = plant_.ask(ControlVerb::reload_host, "");
  EXPECT_EQ(reply.code, ErrorCode::invalid_argument);
  EXPECT_THAT(reply.text, AllOf(HasSubstr("lamp.so"), HasSubstr("'lamp' application")));
  EXPECT_FALSE(is_listed("lamp"));
  expect_nothing_left();
}

TEST_F(Reload, IsDoneForASignal) {
  start();
  plant_.add("packer1", "packer");
  plant_.write_configuration();
  plant_.signal_manager(SIGHUP);
  plant_.signal_manager(SIGHUP);
  EXPECT_TRUE(plant_.wait_for("packer1", InstanceState::running));
  EXPECT_THAT(plant_.log(), HasSubstr("reload: instance 'packer1': new"));
  expect_undisturbed("line1", line1_);
  expect_nothing_left();
}

TEST_F(Reload, IsDoneOnceForEachOfSeveralThatCome) {
  start();
  plant_.add("packer1", "packer");
  plant_.write_configuration();
  auto link = plant_.connect();
  for (std::uint64_t number = 1; number <= 3; ++number) {
    ASSERT_TRUE(link.send(encode(
        ControlRequest{.number = number, .verb = ControlVerb::reload_host, .instance = "", .argument = ""})));
  }
  std::string all;
  for (int i = 0; i < 3; ++i) {
    const auto packet = receive_until(link, MonotonicClock::now() + std::chrono::seconds(30));
    ASSERT_TRUE(packet);
    all += decode_reply(*packet)->text + "\n";
  }
  EXPECT_EQ(all, "instance 'packer1': new\nnothing has changed\nnothing has changed\n");
  expect_nothing_left();
}

TEST_F(Reload, TakesOverWhileAnInstanceStarts) {
  plant_.add("line1", "bottling_line");
  plant_.start_manager();
  plant_.clear_instances();
  plant_.add("line1", "bottling_line", "restart = \"always\"");
  plant_.add("drive1", "drive_axis");
  const auto reply = reload();
  EXPECT_EQ(reply.text, "instance 'line1': restart changed, used at once\ninstance 'drive1': new");
  EXPECT_TRUE(plant_.wait_for("line1", InstanceState::running));
  EXPECT_TRUE(plant_.wait_for("drive1", InstanceState::running));
  expect_nothing_left();
}

TEST_F(Reload, IsNotLostWhenTheManagerIsKilledRightAfterIt) {
  start();
  plant_.clear_instances();
  plant_.add("line1", "packer");
  plant_.add("packer1", "packer");
  ASSERT_EQ(reload().code, ErrorCode::ok);
  plant_.kill_manager();
  plant_.start_manager();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  ASSERT_TRUE(plant_.wait_for("packer1", InstanceState::running));
  expect_undisturbed("line1", line1_);
  expect_undisturbed("drive1", drive1_);
  EXPECT_EQ(plant_.status("drive1").removed, 1U);
  EXPECT_THAT(std::string(plant_.status("line1").problem.view()), HasSubstr("the configuration has changed"));
  EXPECT_EQ(plant_.ask(ControlVerb::restart, "line1").code, ErrorCode::ok);
  EXPECT_THAT(std::string(plant_.status("line1").application.view()), HasSubstr("packer"));
  EXPECT_EQ(plant_.ask(ControlVerb::stop, "drive1").code, ErrorCode::ok);
  EXPECT_TRUE(disappears("drive1"));
  expect_nothing_left();
}

TEST_F(Reload, AManagerListsWhatRunsAndWasRemovedWhileNoManagerRan) {
  start();
  plant_.kill_manager();
  plant_.clear_instances();
  plant_.add("line1", "bottling_line");
  plant_.start_manager();
  ASSERT_TRUE(plant_.wait_for("drive1", InstanceState::running));
  expect_undisturbed("drive1", drive1_);
  // It was running for the manager before, too.
  EXPECT_TRUE(Plant::eventually([&] { return plant_.status("drive1").removed == 1; }));
  plant_.add("drive1", "drive_axis");
  EXPECT_THAT(reload().text, AllOf(HasSubstr("in the configuration again"), Not(HasSubstr("has changed"))));
  expect_undisturbed("drive1", drive1_);
  EXPECT_EQ(plant_.ask(ControlVerb::restart, "drive1").code, ErrorCode::ok);
  expect_nothing_left();
}

// It ends with the host, as all do.
TEST_F(Reload, EndsARemovedInstanceWithTheManager) {
  start();
  remove_drive1();
  expect_nothing_left();
  EXPECT_NE(::kill(drive1_, 0), 0);
}

}  // namespace
}  // namespace plchost
