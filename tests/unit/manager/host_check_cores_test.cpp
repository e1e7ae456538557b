#include <gmock/gmock.h>

#include "tests/unit/manager/fake_tree.hpp"

namespace plchost {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kIsolated = "/sys/devices/system/cpu/isolated";

TEST(HostCheckCores, NameTheInstancesWhoseCoresAreNotIsolated) {
  const FakeTree tree;
  EXPECT_THAT(tree.look("isolated_cores").found, StartsWith("not known: "));
  tree.write(kIsolated, "3\n");
  const auto found = tree.look("isolated_cores");
  EXPECT_EQ(found.level, FindingLevel::warning);
  EXPECT_EQ(found.subject, "core 2 (line1)");
  EXPECT_THAT(found.advice, HasSubstr("isolcpus=managed_irq,domain,2-3"));
  tree.write("/sys/fs/cgroup/cpuset.cpus.isolated", "2\n");
  EXPECT_EQ(tree.look("isolated_cores").level, FindingLevel::ok) << "isolated by a cpuset";
  tree.write(kIsolated, "2 and 3\n");
  EXPECT_THAT(tree.look("isolated_cores").found, StartsWith("not known: "));
}

TEST(HostCheckCores, AreFineWithoutInstances) {
  FakeTree tree;
  tree.host.instances.clear();
  tree.write(kIsolated, "\n");
  tree.write("/proc/cmdline", "quiet\n");
  tree.write("/sys/devices/system/cpu/nohz_full", "(null)\n");
  for (const char* id : {"isolated_cores", "siblings", "governor", "tick", "rcu_callbacks", "shared_cores",
                         "housekeeping", "allowed_cores"}) {
    EXPECT_EQ(tree.look(id).level, FindingLevel::ok) << id;
  }
}

TEST(HostCheckCores, NoteTheTickOfTheKernel) {
  const FakeTree tree;
  EXPECT_EQ(tree.look("tick").found, "the kernel cannot do it");
  tree.write("/sys/devices/system/cpu/nohz_full", "(null)\n");
  EXPECT_EQ(tree.look("tick").level, FindingLevel::note);
  EXPECT_THAT(tree.look("tick").advice, HasSubstr("nohz_full=2-3"));
  tree.write("/sys/devices/system/cpu/nohz_full", "1-3\n");
  EXPECT_EQ(tree.look("tick").level, FindingLevel::ok);
  tree.write("/sys/devices/system/cpu/nohz_full", "x\n");
  EXPECT_THAT(tree.look("tick").found, StartsWith("not known: "));
}

TEST(HostCheckCores, ReadOffTheCommandLineWhereRcuRuns) {
  const FakeTree tree;
  EXPECT_THAT(tree.look("rcu_callbacks").found, StartsWith("not known: /proc/cmdline"));
  const auto level = [&](const char* line) {
    tree.write("/proc/cmdline", line);
    return tree.look("rcu_callbacks").level;
  };
  EXPECT_EQ(level("quiet\n"), FindingLevel::note);
  EXPECT_EQ(level("rcu_nocbs=2 nohz_full=3\n"), FindingLevel::ok);
  EXPECT_EQ(level("rcu_nocbs=all\n"), FindingLevel::ok);
  EXPECT_EQ(level("rcu_nocbs=1\n"), FindingLevel::note);
  EXPECT_EQ(level("quiet -- rcu_nocbs=2-3\n"), FindingLevel::note) << "that is for init";
  level("rcu_nocbs=1-N\n");
  EXPECT_THAT(tree.look("rcu_callbacks").found, HasSubstr("'rcu_nocbs=1-N' in /proc/cmdline"));
}

void pair_up(const FakeTree& tree, const char* first, const char* second) {
  tree.write("/sys/devices/system/cpu/cpu2/topology/thread_siblings_list", first);
  tree.write("/sys/devices/system/cpu/cpu3/topology/thread_siblings_list", second);
}

TEST(HostCheckCores, WarnOfSiblingsThatWorkForOthers) {
  const FakeTree tree;
  EXPECT_THAT(tree.look("siblings").found, StartsWith("not known: "));
  pair_up(tree, "2\n", "3\n");
  EXPECT_EQ(tree.look("siblings").level, FindingLevel::ok);
  pair_up(tree, "0,2\n", "1,3\n");
  const auto found = tree.look("siblings");
  EXPECT_EQ(found.level, FindingLevel::warning);
  EXPECT_EQ(found.subject, "core 2 (line1), core 3 (line2)");
  EXPECT_THAT(found.found, HasSubstr("core 2 is one with core 0, which works for all programs"));
  tree.write(kIsolated, "0-1\n");
  EXPECT_EQ(tree.look("siblings").level, FindingLevel::ok) << "isolated, and no instance there";
  tree.remove(kIsolated);
  tree.write("/sys/devices/system/cpu/online", "2-3\n");
  EXPECT_EQ(tree.look("siblings").level, FindingLevel::ok) << "off line";
}

TEST(HostCheckCores, WarnOnceOfTwoInstancesOnSiblings) {
  const FakeTree tree;
  pair_up(tree, "2-3\n", "2-3\n");
  tree.write(kIsolated, "2-3\n");
  const auto found = tree.look("siblings");
  EXPECT_EQ(found.level, FindingLevel::warning);
  EXPECT_EQ(found.found, "core 2 is one with core 3 (line2)");
}

TEST(HostCheckCores, CountsManyInstancesAndNamesTheFirstOnes) {
  FakeTree tree;
  tree.host.instances.clear();
  for (int i = 1; i <= 64; ++i) {
    tree.host.instances.push_back({fmt::format("line{}", i), i + 1});
    tree.write(fmt::format("/sys/devices/system/cpu/cpu{}/topology/thread_siblings_list", i + 1),
               fmt::format("{},{}\n", i + 1, i + 101));
  }
  tree.write(kIsolated, "\n");
  tree.write("/sys/devices/system/cpu/online", "0-255\n");
  EXPECT_EQ(tree.look("isolated_cores").subject,
            "64 instances on cores 2-65 (line1, line2, line3, and 61 more)");
  const auto found = tree.look("siblings");
  EXPECT_EQ(found.subject, "64 instances on cores 2-65 (line1, line2, line3, and 61 more)");
  EXPECT_THAT(found.found, StartsWith("core 2 is one with core 102, which works for all programs; core 3"));
  EXPECT_THAT(found.found, EndsWith("; and 61 more"));
  for (auto& instance : tree.host.instances) instance.core = 2;
  EXPECT_EQ(tree.look("isolated_cores").subject, "64 instances on core 2 (line1, line2, line3, and 61 more)");
}

TEST(HostCheckCores, KeepOneCoreForTheHost) {
  FakeTree tree;
  EXPECT_EQ(tree.look("housekeeping").found, "0-1");
  tree.host.instances[0].core = 0;
  EXPECT_EQ(tree.look("housekeeping").level, FindingLevel::warning);
  EXPECT_EQ(tree.look("housekeeping").subject, "core 0 (line1)");
  tree.write("/sys/devices/system/cpu/online", "0,3\n");
  EXPECT_THAT(tree.look("housekeeping").found, HasSubstr("every core"));
  tree.write("/sys/devices/system/cpu/online", "");
  tree.make_unreadable("/sys/devices/system/cpu/online");
  EXPECT_THAT(tree.look("housekeeping").found, StartsWith("not known: "));
}

TEST(HostCheckCores, NoteInstancesThatShareOne) {
  FakeTree tree;
  EXPECT_EQ(tree.look("shared_cores").level, FindingLevel::ok);
  tree.host.instances.push_back({"line3", 2});
  EXPECT_EQ(tree.look("shared_cores").level, FindingLevel::note);
  EXPECT_EQ(tree.look("shared_cores").subject, "core 2 (line1, line3)");
}

TEST(HostCheckCores, NoteWorkAndNewInterruptsOfTheKernelThere) {
  const FakeTree tree;
  for (const auto& [id, path] : {std::pair{"workqueues", "/sys/devices/virtual/workqueue/cpumask"},
                                 std::pair{"default_interrupts", "/proc/irq/default_smp_affinity"}}) {
    EXPECT_THAT(tree.look(id).found, StartsWith("not known: ")) << id;
    tree.write(path, "7\n");
    EXPECT_EQ(tree.look(id).level, FindingLevel::note) << id;
    EXPECT_EQ(tree.look(id).subject, "core 2 (line1)") << id;
    tree.write(path, "00000000,00000003\n");
    EXPECT_EQ(tree.look(id).level, FindingLevel::ok) << id;
    tree.write(path, "mask\n");
    EXPECT_THAT(tree.look(id).found, StartsWith("not known: ")) << id;
  }
}

TEST(HostCheckCores, ListTheInterruptsThatComeThere) {
  const FakeTree tree;
  EXPECT_THAT(tree.look("interrupts").found, StartsWith("not known: /proc/irq"));
  const auto add = [&](int number, const char* handler, const char* effective, const char* allowed) {
    const std::string folder = fmt::format("/proc/irq/{}", number);
    if (*handler != '\0') tree.make_folder(folder + "/" + handler);
    if (*effective != '\0') tree.write(folder + "/effective_affinity_list", effective);
    tree.write(folder + "/smp_affinity_list", allowed);
  };
  add(1, "i8042", "0\n", "0-3\n");
  add(2, "", "2\n", "0-3\n");  // nobody handles it
  tree.write("/proc/irq/default_smp_affinity", "f\n");
  EXPECT_EQ(tree.look("interrupts").level, FindingLevel::ok) << "where it goes counts, not where it may";
  add(24, "eth0-rx", "3\n", "0-3\n");
  add(25, "eth0-tx", "", "2-3\n");
  const auto found = tree.look("interrupts");
  EXPECT_EQ(found.level, FindingLevel::warning);
  EXPECT_EQ(found.subject, "core 2 (line1), core 3 (line2)");
  EXPECT_EQ(found.found, "2 interrupts: 24 eth0-rx on 3; 25 eth0-tx on 2-3");
  for (int number = 30; number < 40; ++number) add(number, "nvme", "2\n", "2\n");
  EXPECT_THAT(tree.look("interrupts").found, HasSubstr("; and 6 more"));
}

TEST(HostCheckCores, SayThatAnInterruptCannotBeLookedAt) {
  const FakeTree tree;
  tree.make_folder("/proc/irq/9/acpi");
  EXPECT_THAT(tree.look("interrupts").found, StartsWith("not known: /proc/irq/9/smp_affinity_list"));
  tree.write("/proc/irq/9/effective_affinity_list", "all\n");
  tree.write("/proc/irq/9/smp_affinity_list", "any\n");
  EXPECT_THAT(tree.look("interrupts").found, HasSubstr("holds 'any'"));
}

}  // namespace
}  // namespace plchost
