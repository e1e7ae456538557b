#include "manager/host_check/host_plan.hpp"

#include <algorithm>
#include <set>
#include <sstream>

#include <gmock/gmock.h>

#include "tests/unit/manager/fake_tree.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;
using testing::StartsWith;

PlanFacts facts_of_four() {
  return {
      .instances = {{"line1", 2}, {"line2", 3}}, .online = {0, 1, 2, 3}, .siblings = {}, .has_grub = true};
}

std::string text_of(const HostPlan& plan, PlanPart part) {
  const auto found = std::ranges::find(plan.files, part, &PlannedFile::part);
  return found == plan.files.end() ? "no such file" : found->text;
}

TEST(HostPlan, IsolatesTheCoresOfTheInstances) {
  const auto plan = plan_host(facts_of_four());
  ASSERT_TRUE(plan);
  EXPECT_THAT(plan->isolated, ElementsAre(2, 3));
  EXPECT_THAT(plan->housekeeping, ElementsAre(0, 1));
  EXPECT_EQ(plan->kernel_words,
            "isolcpus=managed_irq,domain,2-3 nohz_full=2-3 rcu_nocbs=2-3 irqaffinity=0-1 preempt=full");
  EXPECT_THAT(plan->files, SizeIs(kPlanPlaces.size()));
  EXPECT_THAT(
      text_of(*plan, PlanPart::grub),
      HasSubstr("\nGRUB_CMDLINE_LINUX_DEFAULT=\"$GRUB_CMDLINE_LINUX_DEFAULT " + plan->kernel_words + "\"\n"));
  EXPECT_THAT(text_of(*plan, PlanPart::sysctl), HasSubstr("\n-kernel.watchdog_cpumask = 0-1\n"));
  const std::string unit = text_of(*plan, PlanPart::unit);
  EXPECT_THAT(unit, HasSubstr("echo 3 >/proc/irq/default_smp_affinity"));
  EXPECT_THAT(unit, HasSubstr("echo 0-1 >\"$$file\""));
  EXPECT_THAT(unit, HasSubstr("for core in 2 3; do"));
  EXPECT_THAT(unit, Not(HasSubstr("[Install]"))) << "systemctl would make a link of its own";
  EXPECT_THAT(text_of(*plan, PlanPart::irqbalance), HasSubstr("IRQBALANCE_BANNED_CPULIST=2-3\n"));
  EXPECT_THAT(text_of(*plan, PlanPart::udev), HasSubstr("try-restart plchost-tuning.service"));
}

TEST(HostPlan, BeginsEachFileWithItsMarkAndTheWayBack) {
  const auto plan = plan_host(facts_of_four());
  ASSERT_TRUE(plan);
  for (const PlannedFile& file : plan->files) {
    if (*place_of(file.part).link != '\0') continue;
    EXPECT_THAT(file.text, StartsWith(std::string(kPlanMark))) << place_of(file.part).path;
    EXPECT_THAT(file.text, HasSubstr("--revert")) << place_of(file.part).path;
    EXPECT_THAT(file.text, Not(HasSubstr("line1"))) << "no name comes into a file that root's programs read";
  }
}

TEST(HostPlan, HasNoFileForGrubWithoutGrub) {
  auto facts = facts_of_four();
  facts.has_grub = false;
  const auto plan = plan_host(facts);
  ASSERT_TRUE(plan);
  EXPECT_THAT(plan->files, SizeIs(kPlanPlaces.size() - 1));
  EXPECT_EQ(text_of(*plan, PlanPart::grub), "no such file");
  EXPECT_THAT(plan->kernel_words, HasSubstr("isolcpus=")) << "for another boot loader";
}

TEST(HostPlan, IsolatesSiblingsButNeverTheFirstCore) {
  auto facts = facts_of_four();
  facts.instances = {{"line1", 2}};
  facts.siblings = {2, 3};
  EXPECT_THAT(plan_host(facts)->isolated, ElementsAre(2, 3));
  facts.siblings = {0, 2};
  const auto plan = plan_host(facts);
  EXPECT_THAT(plan->isolated, ElementsAre(2));
  EXPECT_THAT(plan->housekeeping, ElementsAre(0, 1, 3));
  facts.instances = {{"a", 1}, {"b", 2}, {"c", 3}};
  facts.siblings = {0, 1, 2, 3};
  EXPECT_THAT(plan_host(facts)->housekeeping, ElementsAre(0));
}

TEST(HostPlan, IsRefusedWithoutACoreThatIsLeftForTheKernel) {
  auto facts = facts_of_four();
  facts.instances.push_back({"line0", 0});
  facts.instances.push_back({"line00", 0});
  const auto plan = plan_host(facts);
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().code, ErrorCode::refused);
  EXPECT_THAT(plan.error().message, HasSubstr("core 0 stays with the kernel, and line0, line00 has it"));
  facts = facts_of_four();
  facts.instances = {{"only", 0}};
  facts.online = {0};
  EXPECT_FALSE(plan_host(facts));
  facts.instances.clear();
  EXPECT_EQ(plan_host(facts).error().code, ErrorCode::not_found);
}

TEST(HostPlan, TakesItsFactsFromTheTreesOfKernelAndFiles) {
  FakeTree tree;
  tree.write("/sys/devices/system/cpu/cpu2/topology/thread_siblings_list", "1-2\n");
  auto facts = plan_facts(tree.host, tree.host.files);
  ASSERT_TRUE(facts);
  EXPECT_THAT(facts->online, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(facts->siblings, ElementsAre(1, 2));
  EXPECT_FALSE(facts->has_grub);
  tree.write("/etc/default/grub", "");
  EXPECT_FALSE(plan_facts(tree.host, tree.host.files)->has_grub) << "left over from an earlier boot loader";
  tree.write("/usr/sbin/update-grub", "");
  EXPECT_TRUE(plan_facts(tree.host, tree.host.files)->has_grub);
  tree.remove("/sys");
  EXPECT_EQ(plan_facts(tree.host, tree.host.files).error().code, ErrorCode::not_found);
}

TEST(HostPlan, KnowsOfEachCheckHowItIsMendedOrWhyNot) {
  std::vector<std::string_view> known;
  for (const Fix& fix : host_fixes()) {
    known.push_back(fix.check);
    EXPECT_THAT(fix.text, Not(IsEmpty())) << fix.check;
    for (const std::string_view path : fix.by) {
      if (path.empty()) continue;
      EXPECT_TRUE(std::ranges::any_of(kPlanPlaces, [&](const PlanPlace& place) {
        return place.path == path;
      })) << path;
    }
  }
  std::vector<std::string_view> checks;
  for (const HostCheck& check : host_checks()) checks.push_back(check.id);
  EXPECT_EQ(known, checks);
}

TEST(HostPlan, FindsWordsOfOthersThatWouldClash) {
  EXPECT_THAT(words_that_clash("GRUB_CMDLINE_LINUX_DEFAULT=\"quiet isolcpus=3 nohz_full=3\"\n"),
              ElementsAre("isolcpus=", "nohz_full="));
  EXPECT_THAT(words_that_clash("# GRUB_CMDLINE_LINUX_DEFAULT=\"isolcpus=3\"\nGRUB_TIMEOUT=5\n"), IsEmpty());
  EXPECT_THAT(words_that_clash(R"(GRUB_CMDLINE_LINUX="a=#1 \"b # c' isolcpus=3"  # nohz_full=3)"),
              ElementsAre("isolcpus="));
}

TEST(HostPlan, FindsAFileThatDropsItsWords) {
  EXPECT_TRUE(replaces_command_line("X=1\n export GRUB_CMDLINE_LINUX_DEFAULT=\"quiet\"\n"));
  EXPECT_TRUE(replaces_command_line("GRUB_CMDLINE_LINUX_DEFAULT="));
  EXPECT_FALSE(replaces_command_line("GRUB_CMDLINE_LINUX_DEFAULT=\"a $GRUB_CMDLINE_LINUX_DEFAULT\"\n"));
  EXPECT_FALSE(replaces_command_line("GRUB_CMDLINE_LINUX_DEFAULT=\"${GRUB_CMDLINE_LINUX_DEFAULT} a\"\n"));
  EXPECT_FALSE(replaces_command_line("# GRUB_CMDLINE_LINUX_DEFAULT=a\nGRUB_CMDLINE_LINUX=\"b\"\n\n"));
}

// The host as the files of the plan leave it after a boot.
void boot_with(const HostPlan& plan, const FakeTree& tree) {
  const std::string list = fmt::format("{}-{}\n", plan.isolated.front(), plan.isolated.back());
  tree.write("/proc/cmdline", "BOOT_IMAGE=/vmlinuz ro " + plan.kernel_words + "\n");
  tree.write("/sys/devices/system/cpu/isolated", list);
  tree.write("/sys/devices/system/cpu/nohz_full", list);
  tree.write("/proc/irq/default_smp_affinity", "3\n");
  tree.write("/sys/devices/virtual/workqueue/cpumask", "3\n");
  tree.write("/sys/kernel/mm/transparent_hugepage/enabled", "always [madvise] never\n");
  std::istringstream lines(text_of(plan, PlanPart::sysctl));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with('-')) continue;
    std::string path = "/proc/sys/" + line.substr(1, line.find(" =") - 1);
    std::ranges::replace(path, '.', '/');
    tree.write(path, line.substr(line.find("= ") + 2) + "\n");
  }
  for (const int core : plan.isolated) {
    tree.write(fmt::format("/sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor", core), "performance\n");
    tree.write(fmt::format("/sys/devices/system/cpu/cpu{}/topology/thread_siblings_list", core),
               fmt::format("{}\n", core));
  }
}

TEST(HostPlan, LeavesNothingToChangeOfWhatItMends) {
  FakeTree tree;
  tree.write("/proc/cmdline", "ro\n");
  tree.write("/sys/devices/system/cpu/isolated", "\n");
  tree.write("/sys/devices/system/cpu/nohz_full", "(null)\n");
  tree.write("/proc/irq/default_smp_affinity", "f\n");
  tree.write("/proc/irq/30/smp_affinity_list", "0-1\n");
  tree.make_folder("/proc/irq/30/eth0");
  tree.write("/sys/devices/virtual/workqueue/cpumask", "f\n");
  tree.write("/sys/kernel/mm/transparent_hugepage/enabled", "[always] madvise never\n");
  tree.write("/proc/sys/kernel/version", "#1 SMP PREEMPT_DYNAMIC Debian\n");
  tree.write("/proc/sys/kernel/watchdog", "1\n");
  tree.write("/proc/sys/kernel/watchdog_cpumask", "0-3\n");
  for (const char* name :
       {"kernel/numa_balancing", "kernel/timer_migration", "vm/compact_unevictable_allowed"})
    tree.write(fmt::format("/proc/sys/{}", name), "1\n");
  for (int core = 2; core <= 3; ++core)
    tree.write(fmt::format("/sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor", core), "powersave\n");
  const auto facts = plan_facts(tree.host, tree.host.files);
  const auto plan = plan_host(*facts);
  ASSERT_TRUE(plan);
  std::set<std::string_view> before;
  std::set<std::string_view> after;
  const auto look = [&](std::set<std::string_view>& bad) {
    for (const Fix& fix : host_fixes()) {
      if (!fix.by[0].empty() && tree.look(fix.check).level != FindingLevel::ok) bad.insert(fix.check);
    }
  };
  look(before);
  EXPECT_THAT(before, SizeIs(13)) << "all but interrupts, which go elsewhere already";
  boot_with(*plan, tree);
  look(after);
  EXPECT_THAT(after, ElementsAre("preemption")) << "PREEMPT_RT is another kernel";
  EXPECT_EQ(plan_host(*plan_facts(tree.host, tree.host.files))->kernel_words, plan->kernel_words)
      << "the plan is the same afterwards";
}

}  // namespace
}  // namespace plchost
