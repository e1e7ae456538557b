#include <gmock/gmock.h>

#include "tests/unit/manager/fake_tree.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kVersion = "/proc/sys/kernel/version";
constexpr const char* kDynamic = "#1 SMP PREEMPT_DYNAMIC Debian 6.1.0\n";

TEST(HostCheckKernel, KnowsARealTimeKernelByItsFileOrItsName) {
  const FakeTree tree;
  tree.write("/sys/kernel/realtime", "1\n");
  EXPECT_EQ(tree.look("preemption").level, FindingLevel::ok);
  tree.remove("/sys/kernel/realtime");
  tree.write(kVersion, "#1 SMP PREEMPT_RT Debian 6.1.0\n");
  EXPECT_EQ(tree.look("preemption").level, FindingLevel::ok);
}

struct Preemption {
  const char* file;
  const char* text;
  const char* found;
  FindingLevel level;
};
class DynamicPreemption : public testing::TestWithParam<Preemption> {};

TEST_P(DynamicPreemption, IsReadWhereTheKernelOrItsBuildTellsIt) {
  const FakeTree tree;
  tree.write(kVersion, kDynamic);
  tree.write("/proc/sys/kernel/osrelease", "6.1.0-13\n");
  tree.write(GetParam().file, GetParam().text);
  const auto found = tree.look("preemption");
  EXPECT_EQ(found.level, GetParam().level);
  EXPECT_THAT(found.found, StartsWith(GetParam().found));
}

constexpr const char* kDebug = "/sys/kernel/debug/sched/preempt";
INSTANTIATE_TEST_SUITE_P(
    HostCheckKernel, DynamicPreemption,
    testing::Values(
        Preemption{kDebug, "none voluntary (full) lazy\n", "full", FindingLevel::note},
        Preemption{kDebug, "none full (lazy)\n", "lazy", FindingLevel::note},
        Preemption{kDebug, "(none) voluntary full\n", "none", FindingLevel::warning},
        Preemption{"/proc/cmdline", "quiet preempt=voluntary -- preempt=full\n", "voluntary",
                   FindingLevel::warning},
        Preemption{"/proc/cmdline", "preempt=odd\n", "not known: the kernel calls it 'odd'",
                   FindingLevel::note},
        Preemption{"/boot/config-6.1.0-13", "CONFIG_A=y\nCONFIG_PREEMPT=y\n", "full", FindingLevel::note},
        Preemption{"/boot/config-6.1.0-13", "# CONFIG_PREEMPT is not set\nCONFIG_PREEMPT_VOLUNTARY=y\n",
                   "voluntary", FindingLevel::warning},
        Preemption{kDebug, "garbage\n", "chosen at boot", FindingLevel::note},
        Preemption{"/boot/config-6.1.0-13", "\x01\x02", "chosen at boot", FindingLevel::note}));

TEST(HostCheckKernel, KnowsAFixedPreemptionModel) {
  const FakeTree tree;
  tree.write(kVersion, "#1 SMP PREEMPT Tue\n");
  EXPECT_EQ(tree.look("preemption").level, FindingLevel::note);
  tree.write(kVersion, "#1 SMP Tue\n");
  EXPECT_EQ(tree.look("preemption").level, FindingLevel::warning);
  tree.make_unreadable(kVersion);
  EXPECT_THAT(tree.look("preemption").found, StartsWith("not known: /proc/sys/kernel/version: "));
}

TEST(HostCheckKernel, JudgesThrottlingByWhatIsLeft) {
  const FakeTree tree;
  const std::string run_time = "/proc/sys/kernel/sched_rt_runtime_us";
  EXPECT_THAT(tree.look("throttling").found, StartsWith("not known: " + run_time));
  tree.write(run_time, "950000\n");
  EXPECT_THAT(tree.look("throttling").found, StartsWith("not known: /proc/sys/kernel/sched_rt_period_us"));
  tree.write("/proc/sys/kernel/sched_rt_period_us", "1000000\n");
  EXPECT_EQ(tree.look("throttling").level, FindingLevel::note);
  EXPECT_THAT(tree.look("throttling").why, HasSubstr("stopped for the rest"));
  tree.write("/proc/sys/kernel/osrelease", "6.18.2-fc\n");
  EXPECT_THAT(tree.look("throttling").why, HasSubstr("since Linux 6.12"));
  tree.write(run_time, "-1\n");
  EXPECT_EQ(tree.look("throttling").level, FindingLevel::ok);
  tree.write(run_time, "1000000\n");
  EXPECT_EQ(tree.look("throttling").level, FindingLevel::ok);
  tree.write(run_time, "0\n");
  EXPECT_EQ(tree.look("throttling").level, FindingLevel::problem);
  tree.write(run_time, "much\n");
  EXPECT_THAT(tree.look("throttling").found, HasSubstr("holds 'much'"));
}

TEST(HostCheckKernel, LeavesTheUsualThrottlingAloneOnIsolatedCores) {
  const FakeTree tree;
  const std::string run_time = "/proc/sys/kernel/sched_rt_runtime_us";
  tree.write(run_time, "950000\n");
  tree.write("/proc/sys/kernel/sched_rt_period_us", "1000000\n");
  tree.write("/sys/devices/system/cpu/isolated", "2\n");
  EXPECT_EQ(tree.look("throttling").level, FindingLevel::note) << "core 3 is for all programs";
  tree.write("/sys/devices/system/cpu/isolated", "2-3\n");
  EXPECT_EQ(tree.look("throttling").level, FindingLevel::ok);
  EXPECT_THAT(tree.look("throttling").advice, HasSubstr("keep the load"));
  tree.write(run_time, "940000\n");
  EXPECT_EQ(tree.look("throttling").level, FindingLevel::note);
}

TEST(HostCheckKernel, TellsTheTimerSlack) {
  const FakeTree tree;
  EXPECT_THAT(tree.look("timer_slack").found, StartsWith("not known: "));
  tree.write("/proc/self/timerslack_ns", "50000\n");
  EXPECT_EQ(tree.look("timer_slack").level, FindingLevel::ok);
  EXPECT_THAT(tree.look("timer_slack").found, HasSubstr("50000 ns"));
}

TEST(HostCheckKernel, NotesTimersThatMayMoveToAnInstance) {
  const FakeTree tree;
  const std::string path = "/proc/sys/kernel/timer_migration";
  EXPECT_THAT(tree.look("timer_migration").found, StartsWith("not known: "));
  tree.make_folder("/proc/sys/kernel");
  EXPECT_EQ(tree.look("timer_migration").found, "the kernel has none");
  tree.write(path, "1\n");
  EXPECT_EQ(tree.look("timer_migration").level, FindingLevel::note);
  tree.write("/sys/devices/system/cpu/nohz_full", "2-3\n");
  EXPECT_EQ(tree.look("timer_migration").level, FindingLevel::ok);
  tree.write(path, "0\n");
  EXPECT_EQ(tree.look("timer_migration").found, "off");
  tree.write(path, "?\n");
  EXPECT_THAT(tree.look("timer_migration").found, StartsWith("not known: "));
}

TEST(HostCheckKernel, JudgesTheClockSource) {
  const FakeTree tree;
  const std::string path = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
  EXPECT_THAT(tree.look("clock_source").found, StartsWith("not known: "));
  const auto level = [&](const char* name) {
    tree.write(path, std::string(name) + "\n");
    return tree.look("clock_source").level;
  };
  EXPECT_EQ(level("tsc"), FindingLevel::ok);
  EXPECT_EQ(level("arch_sys_counter"), FindingLevel::ok);
  EXPECT_EQ(level("kvm-clock"), FindingLevel::note);
  EXPECT_EQ(level("hpet"), FindingLevel::warning);
  EXPECT_EQ(level("something"), FindingLevel::warning);
}

TEST(HostCheckKernel, NotesAWatchdogOnAnInstancesCore) {
  const FakeTree tree;
  EXPECT_THAT(tree.look("watchdog").found, StartsWith("not known: "));
  tree.write("/proc/sys/kernel/watchdog", "1\n");
  EXPECT_THAT(tree.look("watchdog").found, StartsWith("not known: /proc/sys/kernel/watchdog_cpumask"));
  tree.write("/proc/sys/kernel/watchdog_cpumask", "0-3\n");
  tree.write("/proc/sys/kernel/nmi_watchdog", "1\n");
  const auto found = tree.look("watchdog");
  EXPECT_EQ(found.level, FindingLevel::note);
  EXPECT_EQ(found.subject, "core 2 (line1), core 3 (line2)");
  EXPECT_EQ(found.found, "watched, by NMI too");
  EXPECT_THAT(found.advice, HasSubstr("watchdog_cpumask=0-1"));
  tree.write("/proc/sys/kernel/watchdog_cpumask", "0-1\n");
  EXPECT_EQ(tree.look("watchdog").level, FindingLevel::ok);
  tree.write("/proc/sys/kernel/watchdog", "0\n");
  EXPECT_EQ(tree.look("watchdog").found, "off");
}

TEST(HostCheckKernel, TellsAContainerByTheFileThatItsMakerHasPutThere) {
  const FakeTree tree;
  EXPECT_EQ(tree.look("container").level, FindingLevel::ok);
  tree.write("/run/.containerenv", "");
  EXPECT_EQ(tree.look("container").level, FindingLevel::note);
  EXPECT_EQ(tree.look("container").found, "/run/.containerenv says that this is one");
}

TEST(HostCheckKernel, TellsAContainerByItsPidNamespaceWhereItsMakerHasPutNoFile) {
  const FakeTree tree;
  tree.write("/proc/1/comm", "systemd\n");
  tree.write("/proc/2/comm", "kthreadd\n");
  EXPECT_EQ(tree.look("container").found, "none");
  tree.write("/proc/2/comm", "plchostd\n");
  EXPECT_EQ(tree.look("container").level, FindingLevel::note);
  EXPECT_EQ(tree.look("container").found, "its PID namespace says that this is one");
}

TEST(HostCheckKernel, TellsAVirtualMachineAndWhatItLost) {
  const FakeTree tree;
  EXPECT_THAT(tree.look("machine").found, StartsWith("not known: "));
  tree.write("/proc/cpuinfo", "processor\t: 0\nflags\t\t: fpu tsc hypervisor lm\n");
  EXPECT_THAT(tree.look("machine").found, HasSubstr("is not known"));
  tree.write("/proc/stat", "cpu  100 0 100 700 0 0 50 50 0 0\ncpu0 1 1\n");
  EXPECT_EQ(tree.look("machine").level, FindingLevel::note);
  EXPECT_THAT(tree.look("machine").found, HasSubstr("5.0 %"));
  tree.write("/proc/stat", "cpu  1 2\n");
  EXPECT_THAT(tree.look("machine").found, HasSubstr("is not known"));
  tree.write("/proc/cpuinfo", "flags\t\t: fpu tsc hypervisor_not lm\n");
  EXPECT_EQ(tree.look("machine").level, FindingLevel::ok);
  tree.write("/proc/cpuinfo", "Features\t: fp asimd\n");
  EXPECT_THAT(tree.look("machine").found, StartsWith("not known: "));
}

}  // namespace
}  // namespace plchost
