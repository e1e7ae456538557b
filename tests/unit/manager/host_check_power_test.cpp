#include <gmock/gmock.h>

#include "tests/unit/manager/fake_tree.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

TEST(HostCheckPower, AcceptsIdleStatesThatInstancesCanHoldOff) {
  const FakeTree tree;
  tree.write("/dev/cpu_dma_latency", "");
  tree.write("/sys/devices/system/cpu/cpuidle/current_driver", "intel_idle\n");
  const std::string states = "/sys/devices/system/cpu/cpu2/cpuidle/";
  tree.write(states + "state0/latency", "0\n");
  tree.write(states + "state1/latency", "133\n");
  tree.write(states + "state1/name", "C6\n");
  tree.write(states + "state2/latency", "900\n");
  tree.write(states + "state2/disable", "1\n");
  tree.write(states + "state3/latency", "long\n");
  const auto found = tree.look("idle_states");
  EXPECT_EQ(found.level, FindingLevel::ok);
  EXPECT_THAT(found.found, HasSubstr("driver intel_idle, deepest state C6 (133 us)"));
}

TEST(HostCheckPower, WarnsWhenNothingCanHoldIdleStatesOff) {
  const FakeTree tree;
  const auto found = tree.look("idle_states");
  EXPECT_EQ(found.level, FindingLevel::warning);
  EXPECT_THAT(found.found,
              AllOf(HasSubstr("driver not known"), HasSubstr("/dev/cpu_dma_latency: No such file")));
  EXPECT_THAT(found.why, HasSubstr("19 instead of 37 us"));
}

TEST(HostCheckPower, WarnsOfAGovernorThatSlowsDown) {
  const FakeTree tree;
  const auto set = [&](int core, const char* name) {
    tree.write(fmt::format("/sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor", core), name);
  };
  EXPECT_THAT(tree.look("governor").found, StartsWith("not known: /sys/devices/system/cpu/cpu2/cpufreq"));
  set(2, "performance\n");
  set(3, "powersave\n");
  const auto found = tree.look("governor");
  EXPECT_EQ(found.level, FindingLevel::warning);
  EXPECT_EQ(found.subject, "core 3 (line2)");
  EXPECT_EQ(found.found, "powersave");
  set(3, "performance\n");
  EXPECT_EQ(tree.look("governor").level, FindingLevel::ok);
}

TEST(HostCheckPower, NeedsNoGovernorWhereTheKernelChangesNoFrequency) {
  const FakeTree tree;
  tree.make_folder("/sys/devices/system/cpu/cpu2");
  EXPECT_EQ(tree.look("governor").level, FindingLevel::ok);
  EXPECT_EQ(tree.look("governor").found, "the kernel changes no frequency");
}

TEST(HostCheckMemory, NotesSwap) {
  const FakeTree tree;
  EXPECT_THAT(tree.look("swap").found, StartsWith("not known: "));
  tree.write("/proc/swaps", "Filename\t\t\t\tType\n");
  EXPECT_EQ(tree.look("swap").level, FindingLevel::ok);
  tree.write("/proc/swaps", "Filename\tType\n/dev/sda2\tpartition 1 0\n/swapfile  file\n");
  EXPECT_EQ(tree.look("swap").level, FindingLevel::note);
  EXPECT_EQ(tree.look("swap").found, "/dev/sda2, /swapfile");
  tree.write("/proc/swaps", "???\n");
  EXPECT_THAT(tree.look("swap").found, StartsWith("not known: "));
  tree.write("/proc/swaps", "");
  EXPECT_THAT(tree.look("swap").found, StartsWith("not known: "));
}

TEST(HostCheckMemory, NotesHugePagesThatAreMadeUnasked) {
  const FakeTree tree;
  const std::string path = "/sys/kernel/mm/transparent_hugepage/enabled";
  EXPECT_THAT(tree.look("huge_pages").found, StartsWith("not known: "));
  tree.make_folder("/sys/kernel/mm");
  EXPECT_EQ(tree.look("huge_pages").found, "the kernel has none");
  tree.write(path, "[always] madvise never\n");
  EXPECT_EQ(tree.look("huge_pages").level, FindingLevel::note);
  tree.write(path, "always [madvise] never\n");
  EXPECT_EQ(tree.look("huge_pages").level, FindingLevel::ok);
  tree.write(path, "always\n");
  EXPECT_THAT(tree.look("huge_pages").found, StartsWith("not known: "));
}

TEST(HostCheckMemory, JudgesWhatMovesPagesOfLockedMemory) {
  const FakeTree tree;
  struct Case {
    const char* id;
    const char* path;
    FindingLevel on;
  };
  for (const Case& each :
       {Case{"compaction", "/proc/sys/vm/compact_unevictable_allowed", FindingLevel::note},
        Case{"numa_balancing", "/proc/sys/kernel/numa_balancing", FindingLevel::warning}}) {
    EXPECT_THAT(tree.look(each.id).found, StartsWith("not known: ")) << each.id;
    tree.write(each.path, "1\n");
    EXPECT_EQ(tree.look(each.id).level, each.on) << each.id;
    tree.write(each.path, "0\n");
    EXPECT_EQ(tree.look(each.id).level, FindingLevel::ok) << each.id;
    tree.write(each.path, "\xff\n");
    EXPECT_EQ(tree.look(each.id).level, FindingLevel::note) << each.id;
    tree.remove(each.path);
    EXPECT_EQ(tree.look(each.id).found, "the kernel has none") << each.id;
  }
}

}  // namespace
}  // namespace plchost
