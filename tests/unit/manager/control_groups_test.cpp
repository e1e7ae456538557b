#include "manager/system/control_groups.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "manager/system/child_process.hpp"
#include "tests/support/group_folder.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(ControlGroupTexts, TellTheGroupOfAProcess) {
  const auto path = [](std::string_view text, std::string_view controller) {
    const auto place = group_place(text, controller);
    return place ? place->controllers + place->path : "nowhere";
  };
  const std::string text = "9:name=systemd:/a\n4:cpu,cpuacct:/b\n0::/system.slice/plchostd.service\n";
  EXPECT_EQ(path(text, ""), "/system.slice/plchostd.service");
  EXPECT_EQ(path(text, "pids"), "/system.slice/plchostd.service");
  EXPECT_EQ(path(text, "cpuacct"), "cpu,cpuacct/b");
  EXPECT_EQ(path("0::/x\n4:cpu:/b\n", "cpu"), "cpu/b") << "in any order";
  EXPECT_EQ(path("0::/", ""), "/");
  EXPECT_EQ(path("4:memory:/b\n10::/x\n", ""), "nowhere");
  EXPECT_EQ(path("garbage\n", "cpu"), "nowhere");
}

TEST(ControlGroupTexts, TellWhereVersion2IsMounted) {
  EXPECT_EQ(
      control_group_mount("31 23 0:28 / /sys/fs/cgroup rw - tmpfs tmpfs rw\n"
                          "32 31 0:29 / /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu\n"
                          "38 31 0:35 / /sys/fs/cgroup/unified rw,relatime shared:9 - cgroup2 cgroup2 rw\n"),
      "/sys/fs/cgroup/unified");
  // A part of the hierarchy that is shown elsewhere is not where the paths of processes begin.
  EXPECT_EQ(control_group_mount(
                "38 31 0:35 /x /part rw - cgroup2 none rw\n39 31 0:35 / /a\\040b rw - cgroup2 none rw\n"),
            "/a b");
  EXPECT_EQ(control_group_mount("31 23 0:28 / /sys rw - sysfs sysfs rw\nno line\n"), "");
}

TEST(ControlGroupTexts, FindTheUnitOfTheGroupsBesideTheManagers) {
  EXPECT_EQ(groups_beside("/sys/fs/cgroup", "/system.slice/plchostd.service"),
            "/sys/fs/cgroup/system.slice/plchost-instances.service");
  EXPECT_EQ(groups_beside("/sys/fs/cgroup", "/plc.slice/plc-a.slice/plchostd.service"),
            "/sys/fs/cgroup/plc.slice/plc-a.slice/plchost-instances.service");
  EXPECT_EQ(groups_beside("/sys/fs/cgroup", "/user.slice/user-0.slice/session-1.scope"), "");
  EXPECT_EQ(groups_beside("/sys/fs/cgroup", "/"), "");
  EXPECT_EQ(groups_beside("", "/system.slice/plchostd.service"), "");
}

TEST(ControlGroupsOfNobody, SayWhyThereAreNone) {
  EXPECT_THAT(ControlGroups::find("/no/such/folder").problem(), HasSubstr("/no/such/folder is not there"));
  const auto plain = std::filesystem::temp_directory_path();
  ControlGroups sut = ControlGroups::find(plain);
  EXPECT_THAT(sut.problem(), HasSubstr("is no control group of version 2"));
  const auto made = sut.make("line1", {});
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::unavailable);
  sut.end("line1");
  EXPECT_TRUE(sut.remove_ended());
  EXPECT_FALSE(std::filesystem::exists(plain / "line1"));
}

TEST(ControlGroupTexts, TellTheLimitsThatWereMet) {
  const auto none = group_counts("low 0\nhigh 0\nmax 7\noom 3\noom_kill 0\noom_group_kill 0\n", "max 0\n");
  EXPECT_EQ(none.oom_kills, 0U);
  EXPECT_EQ(none.pids_refused, 0U);
  const auto some = group_counts("low 0\nmax 7\noom 3\noom_kill 2\noom_group_kill 1\n", "max 5\n");
  EXPECT_EQ(some.oom_kills, 2U);
  EXPECT_EQ(some.pids_refused, 5U);
  EXPECT_EQ(group_counts("", "").oom_kills, 0U) << "no controller";
}

constexpr const char* kNoLimits = "needs the controllers of memory and pids in version 2";

class ControlGroupsTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!folder_.there()) GTEST_SKIP() << kNoGroupFolder;
    sut_ = ControlGroups::find(folder_.path());
    ASSERT_THAT(sut_.problem(), IsEmpty());
  }
  /// Runs a script in the group.
  Result<ChildProcess> run_in(const std::string& group, const std::string& script) {
    return spawn_process(
        {.arguments = {"/bin/sh", "-c", fmt::format("echo 0 >{}/cgroup.procs\n{}", group, script)}});
  }
  [[nodiscard]] bool lacks(std::string_view controller) const {
    return std::ranges::any_of(sut_.missing(), [&](const auto& one) { return one.controller == controller; });
  }

  GroupFolder folder_;
  ControlGroups sut_;
};

TEST_F(ControlGroupsTest, EndWhatHasLeftItsSession) {
  const auto made = sut_.make("line1", {});
  ASSERT_TRUE(made) << made.error().describe();
  EXPECT_EQ(made->folder, folder_.path() + "/line1");
  EXPECT_THAT(made->refused, IsEmpty());
  const auto process = run_in(made->folder, "setsid sleep 1000 & wait");
  ASSERT_TRUE(process);
  ASSERT_TRUE(folder_.comes_to("line1", 2));
  kill_and_reap(*process);
  EXPECT_EQ(folder_.processes("line1"), 1);
  sut_.end("line1");
  EXPECT_TRUE(folder_.comes_to("line1", 0));
  for (int i = 0; i < 1000 && !sut_.remove_ended(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_FALSE(folder_.has("line1"));
}

TEST_F(ControlGroupsTest, AreRemovedWithTheGroupsThatAProcessHasMadeInThem) {
  ASSERT_TRUE(sut_.make("line1", {}));
  std::filesystem::create_directories(folder_.path() + "/line1/a/b");
  sut_.end("line1");
  EXPECT_TRUE(sut_.remove_ended());
  EXPECT_FALSE(folder_.has("line1"));
}

// Else the kernel's counts of an earlier process would be told of the next one.
TEST_F(ControlGroupsTest, AreMadeAnewAlsoWithTheGroupsOfAnEarlierProcess) {
  ASSERT_TRUE(sut_.make("line1", {}));
  std::filesystem::create_directories(folder_.path() + "/line1/a/b");
  ASSERT_TRUE(sut_.make("line1", {}));
  EXPECT_FALSE(folder_.has("line1/a"));
}

TEST_F(ControlGroupsTest, TellOfTheLastProcessOnlyWhichLimitsItHasMet) {
  if (lacks("memory") || lacks("pids")) GTEST_SKIP() << kNoLimits;
  const GroupLimits limits{.memory_bytes = 8U << 20, .pids = 2};
  ASSERT_TRUE(sut_.make("line1", limits));
  const std::string group = folder_.path() + "/line1";
  const auto forks = run_in(group, "sleep 1000 & sleep 1000 & sleep 1000 & wait");
  ASSERT_TRUE(forks);
  for (int i = 0; i < 1000 && sut_.counts("line1").pids_refused == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_NE(sut_.counts("line1").pids_refused, 0U);
  kill_and_reap(*forks);
  const auto fills = run_in(group, "exec tail /dev/zero");
  ASSERT_TRUE(fills);
  for (int i = 0; i < 1000 && sut_.counts("line1").oom_kills == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_NE(sut_.counts("line1").oom_kills, 0U);
  kill_and_reap(*fills);
  // A process keeps the group from being made anew.
  const auto left = run_in(group, "exec sleep 1000");
  ASSERT_TRUE(left);
  ASSERT_TRUE(folder_.comes_to("line1", 1));
  ControlGroups next = ControlGroups::find(folder_.path());
  EXPECT_NE(next.counts("line1").oom_kills, 0U) << "the process that it had may have ended by that";
  ASSERT_TRUE(sut_.make("line1", limits));
  EXPECT_EQ(sut_.counts("line1").oom_kills, 0U);
  EXPECT_EQ(sut_.counts("line1").pids_refused, 0U);
  next.take_over("line1");
  EXPECT_EQ(next.counts("line1").oom_kills, 0U);
  kill_and_reap(*left);
}

TEST_F(ControlGroupsTest, AreUsedAgainByTheNextProcess) {
  ASSERT_TRUE(sut_.make("line1", {}));
  const auto process = run_in(folder_.path() + "/line1", "exec sleep 1000");
  ASSERT_TRUE(process);
  ASSERT_TRUE(folder_.comes_to("line1", 1));
  ControlGroups next = ControlGroups::find(folder_.path());
  const auto again = next.make("line1", {});
  ASSERT_TRUE(again) << again.error().describe();
  EXPECT_EQ(folder_.processes("line1"), 1) << "a new manager ends nobody";
  next.remove_empty("line");
  EXPECT_TRUE(folder_.has("line1")) << "a process is in it";
  kill_and_reap(*process);
  next.remove_empty("line");
  EXPECT_FALSE(folder_.has("line1"));
}

TEST_F(ControlGroupsTest, EndWithAllWhoseNamesBeginTheSame) {
  const std::string trial = trial_group_name("p", "line1");
  const std::string instance = control_group_name("p", "line1");
  std::vector<ChildProcess> processes;
  for (const std::string& group : {trial, instance}) {
    ASSERT_TRUE(sut_.make(group, {}));
    auto process = run_in(folder_.path() + "/" + group, "exec sleep 1000");
    ASSERT_TRUE(process);
    processes.push_back(*std::move(process));
    ASSERT_TRUE(folder_.comes_to(group, 1));
  }
  ControlGroups next = ControlGroups::find(folder_.path());
  next.end_all(trial_group_name("p", ""));
  kill_and_reap(processes.front());
  for (int i = 0; i < 1000 && !next.remove_ended(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_FALSE(folder_.has(trial));
  EXPECT_EQ(folder_.processes(instance), 1);
  kill_and_reap(processes.back());
}

// Names of pools and instances may have dots.
TEST(NamesOfGroups, OfTrialsAreThoseOfNoInstance) {
  EXPECT_NE(trial_group_name("p", "instance.b"), control_group_name("p.trial", "b"));
  EXPECT_NE(trial_group_name("p", "b"), control_group_name("p", "trial.b"));
  EXPECT_FALSE(control_group_name("p.trial", "b").starts_with(trial_group_name("p", "")));
}

TEST_F(ControlGroupsTest, HaveTheLimitsOfTheLastStartOnly) {
  if (lacks("memory") || lacks("pids")) GTEST_SKIP() << kNoLimits;
  ASSERT_TRUE(sut_.make("line1", {.memory_bytes = 64U << 20, .pids = 20}));
  EXPECT_EQ(folder_.text("line1", "memory.max"), "67108864");
  EXPECT_EQ(folder_.text("line1", "memory.oom.group"), "1");
  EXPECT_EQ(folder_.text("line1", "pids.max"), "20");
  ASSERT_TRUE(sut_.make("line1", {}));
  EXPECT_EQ(folder_.text("line1", "memory.max"), "max");
  EXPECT_EQ(folder_.text("line1", "pids.max"), "max");
}

TEST_F(ControlGroupsTest, SayWhichControllersAreMissing) {
  const std::string offered = folder_.text("", "cgroup.controllers");
  for (const std::string controller : {"memory", "pids"}) {
    EXPECT_EQ(lacks(controller), !(" " + offered + " ").contains(" " + controller + " "));
  }
  const auto made = sut_.make("line1", {.memory_bytes = 64U << 20, .pids = 20});
  EXPECT_TRUE(made) << "it is a group all the same";
  sut_.end("line1");
}

}  // namespace
}  // namespace plchost
