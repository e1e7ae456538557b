#include "manager/system/control_groups.hpp"

#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/integration/manager/plant.hpp"
#include "tests/support/group_folder.hpp"

namespace plchost {
namespace {

using testing::IsEmpty;

/// A plant whose instance "line1" has started a process that is in no session of its own.
class GroupsOfInstances : public testing::Test {
 protected:
  void SetUp() override {
    if (!folder_.there()) GTEST_SKIP() << kNoGroupFolder;
    plant_.set_host_keys(fmt::format("instance_groups = \"{}\"", folder_.path()));
    plant_.add("line1", "fault_leaves", "restart_delay_ms = 10\nmemory_max_mib = 512\noom_score = 100");
    plant_.start_manager();
    ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
    group_ = control_group_name(plant_.pool(), "line1");
    ASSERT_TRUE(folder_.comes_to(group_, 2)) << folder_.processes(group_);
  }
  void TearDown() override {
    if (!folder_.there()) return;
    EXPECT_EQ(plant_.stop_manager().describe(), "exit code 0");
    EXPECT_THAT(plant_.leftovers(), IsEmpty());
    EXPECT_FALSE(folder_.has(group_));
  }

  GroupFolder folder_;
  Plant plant_;
  std::string group_;
};

TEST_F(GroupsOfInstances, EndWithAllThatTheApplicationHasStarted) {
  const int before = plant_.status("line1").pid;
  plant_.kill_instances();
  ASSERT_TRUE(Plant::eventually([&] { return plant_.status("line1").restarts == 1; }));
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  EXPECT_NE(plant_.status("line1").pid, before);
  EXPECT_TRUE(folder_.comes_to(group_, 2)) << "those of the second process only";
}

TEST_F(GroupsOfInstances, AreFoundByTheNextManager) {
  const int pid = plant_.status("line1").pid;
  plant_.kill_manager();
  plant_.start_manager();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  EXPECT_EQ(plant_.status("line1").pid, pid);
  EXPECT_EQ(folder_.processes(group_), 2);
  plant_.kill_instances();
  ASSERT_TRUE(Plant::eventually([&] { return plant_.status("line1").restarts == 1; }));
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  EXPECT_TRUE(folder_.comes_to(group_, 2));
}

TEST_F(GroupsOfInstances, EndAlsoIfTheProcessEndedWhileNoManagerRan) {
  plant_.kill_manager();
  plant_.kill_instances();
  EXPECT_TRUE(folder_.comes_to(group_, 1)) << "nobody has ended it";
  plant_.start_manager();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  EXPECT_TRUE(folder_.comes_to(group_, 2));
}

TEST_F(GroupsOfInstances, HaveTheInstanceWithItsOomScore) {
  std::ifstream file(fmt::format("/proc/{}/oom_score_adj", plant_.status("line1").pid));
  int score = 0;
  file >> score;
  EXPECT_EQ(score, 100);
}

TEST_F(GroupsOfInstances, AreToldByTheCheckOfTheHostIfAProcessIsNotInIts) {
  const auto told = [&] { return plant_.ask(ControlVerb::check_host, "").text; };
  EXPECT_FALSE(told().contains("without limits of its own")) << told();
  std::filesystem::create_directory(folder_.path() + "/other");
  std::ofstream(folder_.path() + "/other/cgroup.procs") << plant_.status("line1").pid << std::flush;
  EXPECT_TRUE(told().contains("line1 is in /")) << told();
}

// Once, by the check of the host.
TEST(LimitsOfInstances, ThatDoNotHoldAreToldAtTheStart) {
  Plant plant;
  plant.set_host_keys("instance_groups = \"/no/such/folder\"");
  plant.add("line1", "bottling_line", "memory_max_mib = 512\npids_max = 100");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  EXPECT_TRUE(Plant::eventually([&] {
    return plant.log().contains(
        "none: /no/such/folder is not there; these limits do not hold: "
        "memory_max_mib of line1, pids_max of line1");
  })) << plant.log();
}

}  // namespace
}  // namespace plchost
