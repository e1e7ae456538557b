// A stopped machine does not start: over the end of the manager, of the instance and of the host's power.

#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/integration/manager/plant.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;

enum class End : bool { processes, power };

class Wishes : public testing::TestWithParam<End> {
 protected:
  /// Ends the manager, and then the instances, which nobody sees.
  void end_all() {
    plant_.kill_manager();
    plant_.kill_instances();
    if (GetParam() == End::power) plant_.lose_memory();
  }
  void next_manager() {
    end_all();
    plant_.start_manager();
  }
  void start(const std::string& keys = "") {
    plant_.add("line1", "bottling_line", keys);
    plant_.start_manager();
    ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  }
  /// A change without a command is on the disk a moment later; the answer to a command comes when it is
  /// there.
  void wait_for_disk(const std::string& scheduler = "CmpSchedule") {
    ASSERT_TRUE(Plant::eventually([&] {
      const auto reply = plant_.ask(ControlVerb::set_scheduler, "line1", scheduler);
      EXPECT_EQ(reply.code, ErrorCode::ok) << reply.text;
      return !reply.text.contains("power cut");
    }));
  }
  /// Long enough for a start that nobody asked for.
  void stays(InstanceState state) {
    ASSERT_TRUE(plant_.wait_for("line1", state));
    EXPECT_FALSE(Plant::within(std::chrono::seconds(1), [&] {
      return plant_.status("line1").state != state;
    })) << to_string(plant_.status("line1").state);
  }

  Plant plant_;
};

TEST_P(Wishes, RunsAgain) {
  start();
  next_manager();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  EXPECT_TRUE(plant_.wait_for_cycles("line1"));
}

TEST_P(Wishes, StaysStopped) {
  start();
  ASSERT_EQ(plant_.ask(ControlVerb::stop, "line1").code, ErrorCode::ok);
  wait_for_disk();
  next_manager();
  stays(InstanceState::stopped);
  ASSERT_EQ(plant_.ask(ControlVerb::start, "line1").code, ErrorCode::ok);
  EXPECT_TRUE(plant_.wait_for_cycles("line1"));
}

TEST_P(Wishes, StaysFailed) {
  start("restart = \"never\"");
  plant_.kill_instances();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::failed));
  wait_for_disk();
  next_manager();
  stays(InstanceState::failed);
}

TEST_P(Wishes, IsNotStartedAgainUnderThePolicyNever) {
  start("restart = \"never\"\nautostart = true");
  next_manager();
  if (GetParam() == End::power) {  // as a host that is switched on does
    ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  } else {
    stays(InstanceState::failed);
  }
}

TEST_P(Wishes, StaysInSafeMode) {
  start("crash_limit = 1\nrestart_delay_ms = 10");
  plant_.kill_instances();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::safe_mode));
  wait_for_disk();
  next_manager();
  stays(InstanceState::safe_mode);
}

TEST_P(Wishes, KeepsSchedulerApplicationAndEvents) {
  start();
  ASSERT_EQ(plant_.ask(ControlVerb::set_scheduler, "line1", "CmpScheduleTimer").code, ErrorCode::ok);
  const std::string axis = Plant::application("drive_axis");
  ASSERT_EQ(plant_.ask(ControlVerb::load_application, "line1", axis).code, ErrorCode::ok);
  ASSERT_EQ(plant_.ask(ControlVerb::register_event, "line1", "door").code, ErrorCode::ok);
  wait_for_disk("CmpScheduleTimer");
  next_manager();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  EXPECT_EQ(plant_.status("line1").scheduler.view(), "CmpScheduleTimer");
  EXPECT_EQ(plant_.status("line1").application.view(), axis);
  EXPECT_EQ(plant_.lines_of("run/line1.events"), std::vector<std::string>{"door"});
}

TEST_P(Wishes, KeepsItsRestarts) {
  start();
  plant_.kill_instances();
  ASSERT_TRUE(Plant::eventually([&] { return plant_.status("line1").restarts == 1; }));
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  wait_for_disk();
  next_manager();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  EXPECT_EQ(plant_.status("line1").restarts, GetParam() == End::power ? 1U : 2U);
}

TEST_P(Wishes, AreOlderThanAChangedConfiguration) {
  start();
  ASSERT_EQ(plant_.ask(ControlVerb::stop, "line1").code, ErrorCode::ok);
  wait_for_disk();
  end_all();
  plant_.clear_instances();
  plant_.add("line1", "drive_axis");
  plant_.start_manager();
  stays(InstanceState::stopped);
  EXPECT_EQ(plant_.status("line1").application.view(), Plant::application("drive_axis"));
  EXPECT_THAT(plant_.log(), testing::Not(testing::HasSubstr("was loaded last"))) << "nobody has loaded any";
}

TEST_P(Wishes, DoNotEndWithTheManagerInOrder) {
  start();
  ASSERT_EQ(plant_.ask(ControlVerb::stop, "line1").code, ErrorCode::ok);
  EXPECT_EQ(plant_.stop_manager().describe(), "exit code 0");
  if (GetParam() == End::power) plant_.lose_memory();
  plant_.start_manager();
  stays(InstanceState::stopped);
}

INSTANTIATE_TEST_SUITE_P(Ends, Wishes, testing::Values(End::processes, End::power), [](const auto& end) {
  return end.param == End::power ? "PowerCut" : "ProcessesKilled";
});

TEST(WishesFolder, IsOneManagersOnly) {
  Plant plant;
  plant.add("line1", "bottling_line", "autostart = false");
  plant.start_manager();
  std::string other = plant.configuration();
  for (const std::string& own : {plant.run_directory() + '"', plant.pool() + '"'}) {
    other.replace(other.find(own), own.size(), own.substr(0, own.size() - 1) + "-b\"");
  }
  plant.write_configuration(other);
  EXPECT_THAT(
      plant.start_refused_manager(),
      AllOf(HasSubstr("another manager keeps the wishes of its instances in " + plant.state_directory() +
                      "/wishes.cell: process " + std::to_string(plant.manager_pid())),
            HasSubstr("give [host] state_directory another folder")));
  EXPECT_EQ(plant.ask(ControlVerb::stop, "line1").code, ErrorCode::ok) << "the first is unharmed";
}

TEST(WishesFolder, ThatCannotBeWrittenKeepsNoInstanceFromRunning) {
  Plant plant;
  plant.add("line1", "bottling_line");
  plant.write_file("state", "in the way");
  plant.start_manager();
  EXPECT_TRUE(plant.wait_for("line1", InstanceState::running));
  EXPECT_THAT(plant.log(), HasSubstr("the manager cannot see whether another one uses it"));
}

}  // namespace
}  // namespace plchost
