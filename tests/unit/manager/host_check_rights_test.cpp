#include <cerrno>

#include <gmock/gmock.h>

#include "tests/unit/manager/fake_tree.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kNoCapabilities = "Name:\tplchostd\nCapEff:\t0000000000000000\nCapBnd:\t0\n";
constexpr const char* kRealTimeCapabilities = "CapEff:\t0000000000804000\n";  // SYS_NICE, IPC_LOCK

std::string limits(const std::string& priority, const std::string& memory) {
  return "Limit                     Soft Limit           Hard Limit           Units     \n"
         "Max locked memory         " +
         memory +
         "              8388608              bytes     \n"
         "Max realtime priority     " +
         priority + "                    0                              \n";
}

TEST(HostCheckRights, AcceptAGrantedRealTimeClass) {
  const FakeTree tree;
  EXPECT_EQ(tree.look("real_time_class").level, FindingLevel::ok);
}

TEST(HostCheckRights, NameTheControlGroupWithoutRealTimeRunTime) {
  FakeTree tree;
  tree.fifo_error = EPERM;
  tree.write("/proc/self/status", kRealTimeCapabilities);
  tree.write("/proc/self/cgroup", "5:cpu,cpuacct:/user.slice/a\n0::/x\n");
  tree.write("/sys/fs/cgroup/cpu,cpuacct/user.slice/a/cpu.rt_runtime_us", "0\n");
  const auto found = tree.look("real_time_class");
  EXPECT_EQ(found.level, FindingLevel::problem);
  EXPECT_THAT(found.found,
              AllOf(HasSubstr("Operation not permitted"),
                    HasSubstr("/sys/fs/cgroup/cpu,cpuacct/user.slice/a/cpu.rt_runtime_us is 0")));
  EXPECT_THAT(found.advice, HasSubstr("echo 950000 > /sys/fs/cgroup/cpu,cpuacct/user.slice/a/"));
}

TEST(HostCheckRights, AskForTheRightWhereItIsMissingAndLookFurtherWhereItIsThere) {
  FakeTree tree;
  tree.fifo_error = EPERM;
  tree.write("/proc/self/status", kNoCapabilities);
  EXPECT_THAT(tree.look("real_time_class").advice, HasSubstr("CAP_SYS_NICE, or LimitRTPRIO"));
  tree.write("/proc/self/status", kRealTimeCapabilities);
  EXPECT_THAT(tree.look("real_time_class").advice, HasSubstr("the right is there"));
  EXPECT_EQ(tree.look("real_time_class").level, FindingLevel::problem);
}

TEST(HostCheckRights, CompareThePriorityLimitWithWhatInstancesUse) {
  const FakeTree tree;
  tree.write("/proc/self/limits", limits("0", "65536"));
  tree.write("/proc/self/status", kRealTimeCapabilities);
  EXPECT_EQ(tree.look("priority_limit").level, FindingLevel::ok);
  tree.write("/proc/self/status", kNoCapabilities);
  EXPECT_EQ(tree.look("priority_limit").level, FindingLevel::problem);
  for (const char* enough : {"89", "99", "unlimited"}) {
    tree.write("/proc/self/limits", limits(enough, "65536"));
    EXPECT_EQ(tree.look("priority_limit").level, FindingLevel::ok) << enough;
  }
  tree.write("/proc/self/limits", limits("88", "65536"));
  const auto found = tree.look("priority_limit");
  EXPECT_EQ(found.level, FindingLevel::problem);
  EXPECT_THAT(found.found, HasSubstr("limit 88"));
}

TEST(HostCheckRights, WarnWhenMemoryCannotBeLocked) {
  const FakeTree tree;
  tree.write("/proc/self/limits", limits("0", "8388608"));
  tree.write("/proc/self/status", kNoCapabilities);
  const auto found = tree.look("memory_lock");
  EXPECT_EQ(found.level, FindingLevel::warning);
  EXPECT_THAT(found.found, HasSubstr("8388608 bytes"));
  tree.write("/proc/self/limits", limits("0", "unlimited"));
  EXPECT_EQ(tree.look("memory_lock").level, FindingLevel::ok);
  tree.write("/proc/self/limits", limits("0", "0"));
  tree.write("/proc/self/status", kRealTimeCapabilities);
  EXPECT_EQ(tree.look("memory_lock").level, FindingLevel::ok);
}

TEST(HostCheckRights, AreNotGuessedFromGarbage) {
  const FakeTree tree;
  for (const char* id : {"priority_limit", "memory_lock"}) {
    EXPECT_EQ(tree.look(id).level, FindingLevel::note) << id;
    EXPECT_THAT(tree.look(id).found, StartsWith("not known: /proc/self/status: No such file")) << id;
  }
  tree.write("/proc/self/status", "CapEff:\tnone\n");
  tree.write("/proc/self/limits", "Max realtime priority\nMax locked memory  much\n");
  EXPECT_THAT(tree.look("priority_limit").found, HasSubstr("/proc/self/status has no CapEff"));
  tree.write("/proc/self/status", kNoCapabilities);
  EXPECT_THAT(tree.look("priority_limit").found, HasSubstr("has no 'Max realtime priority'"));
  EXPECT_THAT(tree.look("memory_lock").found, HasSubstr("has no 'Max locked memory'"));
}

TEST(HostCheckRights, FindTheInstanceThatTheControlGroupHasNoCoreFor) {
  const FakeTree tree;
  tree.write("/proc/self/cgroup", "0::/system.slice/plchostd.service\n");
  tree.write("/sys/fs/cgroup/system.slice/plchostd.service/cgroup.procs", "1\n");
  tree.write("/sys/fs/cgroup/system.slice/cpuset.cpus.effective", "0-2\n");
  const auto found = tree.look("allowed_cores");
  EXPECT_EQ(found.level, FindingLevel::problem);
  EXPECT_EQ(found.subject, "core 3 (line2)");
  EXPECT_THAT(found.found, HasSubstr("not among 0-2"));
  tree.write("/sys/fs/cgroup/system.slice/cpuset.cpus.effective", "0-3\n");
  EXPECT_EQ(tree.look("allowed_cores").level, FindingLevel::ok);
  tree.write("/sys/fs/cgroup/system.slice/cpuset.cpus.effective", "all of them\n");
  EXPECT_THAT(tree.look("allowed_cores").found, StartsWith("not known: "));
  tree.remove("/sys/fs/cgroup");
  tree.write("/sys/devices/system/cpu/online", "0-1\n");
  EXPECT_EQ(tree.look("allowed_cores").level, FindingLevel::problem)
      << "no control groups: the cores on line count";
}

TEST(HostCheckRights, FindAQuotaInAnyGroupAbove) {
  const FakeTree tree;
  EXPECT_THAT(tree.look("cpu_quota").found, StartsWith("not known: "));
  tree.write("/proc/self/cgroup", "garbage\n0::/a/b\n");
  tree.write("/sys/fs/cgroup/a/b/cpu.max", "max 100000\n");
  tree.write("/sys/fs/cgroup/a/cpu.max", "max 100000\n");
  EXPECT_EQ(tree.look("cpu_quota").level, FindingLevel::ok);
  tree.write("/sys/fs/cgroup/a/cpu.max", "50000 100000\n");
  const auto found = tree.look("cpu_quota");
  EXPECT_EQ(found.level, FindingLevel::warning);
  EXPECT_THAT(found.found, HasSubstr("/sys/fs/cgroup/a/cpu.max is '50000 100000'"));
  tree.write("/proc/self/cgroup", "1:cpu:/c\n");
  tree.write("/sys/fs/cgroup/cpu/c/cpu.cfs_quota_us", "-1\n");
  EXPECT_EQ(tree.look("cpu_quota").level, FindingLevel::ok);
  tree.write("/sys/fs/cgroup/cpu/c/cpu.cfs_quota_us", "20000\n");
  EXPECT_EQ(tree.look("cpu_quota").level, FindingLevel::warning);
}

// The manager is in one unit, and the instances in another one.
TEST(HostCheckRights, LookAtTheGroupsInWhichInstancesAre) {
  FakeTree tree;
  tree.write("/proc/self/cgroup", "0::/system.slice/plchostd.service\n");
  tree.write("/sys/fs/cgroup/system.slice/plchostd.service/cpu.max", "max 100000\n");
  tree.write("/sys/fs/cgroup/system.slice/plchostd.service/cpuset.cpus.effective", "0\n");
  const std::string groups = "/sys/fs/cgroup/system.slice/plchost-instances.service";
  tree.write(groups + "/cpuset.cpus.effective", "2-3\n");
  tree.write(groups + "/cpu.max", "max 100000\n");
  tree.host.groups = {.folder = groups, .problem = "", .missing = {}};
  EXPECT_EQ(tree.look("allowed_cores").level, FindingLevel::ok) << tree.look("allowed_cores").found;
  EXPECT_EQ(tree.look("allowed_cores").found, "2-3 (" + groups + "/cpuset.cpus.effective)");
  EXPECT_EQ(tree.look("cpu_quota").level, FindingLevel::ok);
  tree.write(groups + "/cpu.max", "50000 100000\n");
  EXPECT_THAT(tree.look("cpu_quota").found, HasSubstr(groups + "/cpu.max is '50000 100000'"));
  tree.write(groups + "/cpu.max", "max 100000\n");
  // A process from before an upgrade is still in the group of the manager.
  tree.host.instances[0].pid = 10;
  tree.write("/proc/10/cgroup", "0::/system.slice/plchostd.service\n");
  EXPECT_EQ(tree.look("allowed_cores").subject, "core 2 (line1)");
  tree.write("/proc/10/cgroup", "0::/other.slice/line1\n");
  tree.write("/sys/fs/cgroup/other.slice/line1/cpuset.cpus.effective", "2\n");
  EXPECT_EQ(tree.look("allowed_cores").level, FindingLevel::ok);
  tree.write("/sys/fs/cgroup/other.slice/cpu.max", "20000 100000\n");
  EXPECT_THAT(tree.look("cpu_quota").found, StartsWith("/sys/fs/cgroup/other.slice/cpu.max is "));
}

TEST(HostCheckRights, FindTheGroupsOfVersion2WhereTheyAreMounted) {
  FakeTree tree;
  tree.write("/proc/self/mountinfo", "38 31 0:35 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw\n");
  tree.write("/proc/self/cgroup", "4:memory:/\n0::/a\n");
  tree.write("/sys/fs/cgroup/unified/a/cpu.max", "50000 100000\n");
  EXPECT_THAT(tree.look("cpu_quota").found, HasSubstr("/sys/fs/cgroup/unified/a/cpu.max is '50000 100000'"));
}

TEST(HostCheckRights, TellTheLimitsOfEachProcess) {
  FakeTree tree;
  tree.host.groups = {.folder = "/sys/fs/cgroup/a", .problem = "", .missing = {}};
  tree.host.instances[0] = {
      .name = "line1", .core = 2, .memory_max = 512U << 20, .pids_max = 100, .pid = 10, .group = "p.1"};
  tree.host.instances[1] = {.name = "line2", .core = 3, .pid = 20, .group = "p.2"};
  tree.write("/sys/fs/cgroup/a/p.1/cgroup.procs", "9\n10\n");
  tree.write("/sys/fs/cgroup/a/p.1/memory.max", "536870912\n");
  tree.write("/sys/fs/cgroup/a/p.1/pids.max", "100\n");
  tree.write("/sys/fs/cgroup/a/p.2/cgroup.procs", "20\n");
  tree.write("/sys/fs/cgroup/a/p.2/memory.max", "max\n");
  tree.write("/sys/fs/cgroup/a/p.2/pids.max", "max\n");
  EXPECT_EQ(tree.look("instance_limits").level, FindingLevel::ok) << tree.look("instance_limits").found;
  // The kernel has refused it, or the configuration has another one since.
  tree.write("/sys/fs/cgroup/a/p.1/pids.max", "max\n");
  auto found = tree.look("instance_limits");
  EXPECT_EQ(found.level, FindingLevel::warning);
  EXPECT_EQ(found.found, "/sys/fs/cgroup/a; line1: pids.max is max, not 100");
  EXPECT_THAT(found.advice, StartsWith("restart these instances"));
  // Still in the group of the manager.
  tree.write("/sys/fs/cgroup/a/p.1/cgroup.procs", "1\n");
  tree.write("/proc/10/cgroup", "0::/system.slice/plchostd.service\n");
  EXPECT_EQ(tree.look("instance_limits").level, FindingLevel::warning);
  EXPECT_EQ(tree.look("instance_limits").found,
            "/sys/fs/cgroup/a; line1 is in /system.slice/plchostd.service without limits of its own");
  tree.host.instances[0].pid = 0;
  tree.write("/sys/fs/cgroup/a/p.2/cgroup.procs", "1\n");
  found = tree.look("instance_limits");
  EXPECT_EQ(found.level, FindingLevel::note) << "nobody has asked for a limit";
  EXPECT_EQ(found.found, "/sys/fs/cgroup/a; line2 is in another group without limits of its own");
}

TEST(HostCheckRights, NameTheLimitsOfInstancesThatDoNotHold) {
  FakeTree tree;
  tree.host.groups = {.folder = "/sys/fs/cgroup/a", .problem = "", .missing = {}};
  tree.host.instances[0].memory_max = 512U << 20;
  tree.host.instances[1].pids_max = 100;
  EXPECT_EQ(tree.look("instance_limits").level, FindingLevel::ok);
  EXPECT_EQ(tree.look("instance_limits").found, "/sys/fs/cgroup/a");
  tree.host.groups.missing = {{"memory", "busy"}};
  auto found = tree.look("instance_limits");
  EXPECT_EQ(found.level, FindingLevel::warning);
  EXPECT_EQ(found.found,
            "/sys/fs/cgroup/a; without memory: busy; these limits do not hold: memory_max_mib of line1");
  tree.host.groups = {.folder = "", .problem = "not there", .missing = {}};
  found = tree.look("instance_limits");
  EXPECT_EQ(found.found,
            "none: not there; these limits do not hold: memory_max_mib of line1, pids_max of line2");
  tree.host.instances = {{.name = "line1", .core = 1}};
  EXPECT_EQ(tree.look("instance_limits").level, FindingLevel::note) << "nobody has asked for one";
}

}  // namespace
}  // namespace plchost
