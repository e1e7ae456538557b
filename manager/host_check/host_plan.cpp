#include "manager/host_check/host_plan.hpp"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>

#include "manager/host_check/checks.hpp"
#include "shm/base/cpu_list.hpp"

namespace plchost {

namespace {

constexpr auto kGrub = place_of(PlanPart::grub).path;
constexpr auto kSysctl = place_of(PlanPart::sysctl).path;
constexpr auto kUnit = place_of(PlanPart::unit).path;

constexpr std::string_view kRights =
    "plchostd.service gives the manager its rights; this is about the manager's process";
constexpr std::string_view kConfiguration = "choose other cores in the configuration";

// In the order of the checks.
constexpr std::array kFixes = {
    Fix{.check = "real_time_class", .text = kRights, .of_manager = true},
    Fix{.check = "priority_limit", .text = kRights, .of_manager = true},
    Fix{.check = "memory_lock", .text = kRights, .of_manager = true},
    Fix{.check = "allowed_cores", .text = kRights, .of_manager = true},
    Fix{.check = "instance_limits", .text = kRights, .of_manager = true},
    Fix{.check = "preemption",
        .by = {kGrub},
        .text = "preempt=full; PREEMPT_RT is another kernel: apt install linux-image-rt-amd64"},
    Fix{.check = "isolated_cores", .by = {kGrub}, .text = "isolcpus="},
    Fix{.check = "housekeeping", .text = kConfiguration},
    Fix{.check = "siblings",
        .by = {kGrub},
        .text = "isolcpus= has the siblings, too, but never core 0 and no core of another instance"},
    Fix{.check = "interrupts",
        .by = {kGrub, kUnit},
        .text = "irqaffinity= and smp_affinity_list; that of a queue which a driver has for this core alone "
                "stays: only programs on the core raise it"},
    Fix{.check = "idle_states", .text = kRights, .of_manager = true},
    Fix{.check = "governor", .by = {kUnit}, .text = "performance"},
    Fix{.check = "clock_source",
        .text = "the firmware or the hypervisor has no good one; only the kernel's log tells whether "
                "tsc=reliable is safe"},
    Fix{.check = "cpu_quota", .text = kRights, .of_manager = true},
    Fix{.check = "numa_balancing", .by = {kSysctl}, .text = "kernel.numa_balancing"},
    Fix{.check = "throttling",
        .text = "it keeps the kernel working beside a task that never ends: an operator's own file in "
                "/etc/sysctl.d decides"},
    Fix{.check = "timer_slack", .text = kRights, .of_manager = true},
    Fix{.check = "timer_migration", .by = {kSysctl}, .text = "kernel.timer_migration"},
    Fix{.check = "tick", .by = {kGrub}, .text = "nohz_full=, if the kernel has CONFIG_NO_HZ_FULL"},
    Fix{.check = "rcu_callbacks", .by = {kGrub}, .text = "rcu_nocbs="},
    Fix{.check = "workqueues", .by = {kUnit}, .text = "cpumask of the work queues"},
    Fix{.check = "default_interrupts", .by = {kGrub, kUnit}, .text = "default_smp_affinity"},
    Fix{.check = "watchdog", .by = {kSysctl}, .text = "kernel.watchdog_cpumask"},
    Fix{.check = "shared_cores", .text = kConfiguration},
    Fix{.check = "swap", .text = "/etc/fstab and units of others turn swap on: take it out there"},
    Fix{.check = "huge_pages", .by = {kUnit}, .text = "madvise"},
    Fix{.check = "compaction", .by = {kSysctl}, .text = "vm.compact_unevictable_allowed"},
    Fix{.check = "machine", .text = "hypervisor and firmware are out of reach of the host's files"},
    Fix{.check = "container", .text = "a container has the kernel of the machine outside"},
};

constexpr std::array kWordsOfPlan = {"isolcpus=", "nohz_full=", "rcu_nocbs=", "irqaffinity=", "preempt="};

constexpr auto kHead =
    "{}'plcctl check host --fix --apply'. The next --apply writes it anew: leave it as it is.\n"
    "# The way back: 'plcctl check host --fix --revert'.\n";

std::string with_head(std::string_view text) {
  return fmt::format(kHead, kPlanMark) + std::string(text);
}

std::string unit_text(const HostPlan& plan) {
  std::string cores;
  for (const int core : plan.isolated) cores += fmt::format(" {}", core);
  const std::string list = format_cpu_list(plan.housekeeping);
  const std::string mask = format_cpu_mask(plan.housekeeping);
  // Without [Install]: the plan has its own link, and 'systemctl enable' would replace it by one of another
  // form.
  // "$$" is systemd's form of "$". Parts that a kernel lacks, and interrupts that it does not let move, are
  // no errors.
  return fmt::format(R"([Unit]
Description=Interrupts, work queues and frequencies for the cores of PLCs
After=systemd-modules-load.service systemd-udev-trigger.service network.target irqbalance.service
Before=plchostd.service
# By the rule of udev it runs again for each driver that comes later.
StartLimitIntervalSec=0

[Service]
Type=oneshot
RemainAfterExit=yes
ExecStart=-/bin/sh -c 'exec 2>/dev/null; echo {mask} >/proc/irq/default_smp_affinity'
ExecStart=-/bin/sh -c 'exec 2>/dev/null; for file in /proc/irq/*/smp_affinity_list; do echo {list} >"$$file"; done'
ExecStart=-/bin/sh -c 'exec 2>/dev/null; echo {mask} >/sys/devices/virtual/workqueue/cpumask'
ExecStart=-/bin/sh -c 'exec 2>/dev/null; cd /sys/kernel/mm/transparent_hugepage; grep -qF "[always]" enabled && echo madvise >enabled'
ExecStart=-/bin/sh -c 'exec 2>/dev/null; for core in{cores}; do echo performance >/sys/devices/system/cpu/cpu$$core/cpufreq/scaling_governor; done'
)",
                     fmt::arg("mask", mask), fmt::arg("list", list), fmt::arg("cores", cores));
}

// A hyphen: without an error on a kernel that does not have it.
std::string sysctl_text(const HostPlan& plan) {
  return fmt::format(
      "-kernel.numa_balancing = 0\n-kernel.timer_migration = 0\n-kernel.watchdog_cpumask = {}\n"
      "-vm.compact_unevictable_allowed = 0\n",
      format_cpu_list(plan.housekeeping));
}

std::string names_on(const PlanFacts& facts, int core) {
  std::string names;
  for (const CheckedHost::Instance& instance : facts.instances) {
    if (instance.core == core) names += (names.empty() ? "" : ", ") + instance.name;
  }
  return names;
}

}  // namespace

bool has_update_grub(const HostFiles& written) {
  return written.exists("/usr/sbin/update-grub");
}

Result<PlanFacts> plan_facts(const CheckedHost& host, const HostFiles& written) {
  PLCHOST_TRY_ASSIGN(auto online, host.files.cores("/sys/devices/system/cpu/online"));
  PlanFacts facts{.instances = host.instances, .online = std::move(online)};
  for (const int core : host_check::plc_cores(host)) {
    const auto together =
        host.files.cores(fmt::format("/sys/devices/system/cpu/cpu{}/topology/thread_siblings_list", core));
    if (together) facts.siblings.insert(facts.siblings.end(), together->begin(), together->end());
  }
  facts.siblings = each_once(std::move(facts.siblings));
  facts.has_grub = has_update_grub(written);
  return facts;
}

Result<HostPlan> plan_host(const PlanFacts& facts) {
  if (facts.instances.empty())
    return failure(ErrorCode::not_found, "no instance has a core: add the instances to the configuration");
  if (facts.online.empty()) return failure(ErrorCode::not_found, "no core is on line");
  const int kept = facts.online.front();
  std::vector<int> cores;
  for (const CheckedHost::Instance& instance : facts.instances) cores.push_back(instance.core);
  cores = each_once(std::move(cores));
  // Else the next start would refuse the configuration: instances may run on the isolated cores only.
  if (std::ranges::binary_search(cores, kept)) {
    return failure(
        ErrorCode::refused,
        fmt::format("core {} stays with the kernel, and {} has it: choose another core in the configuration",
                    kept, names_on(facts, kept)));
  }
  HostPlan plan;
  cores.insert(cores.end(), facts.siblings.begin(), facts.siblings.end());
  plan.isolated = cores_without(each_once(std::move(cores)), {kept});
  plan.housekeeping = cores_without(facts.online, plan.isolated);
  const std::string list = format_cpu_list(plan.isolated);
  plan.kernel_words =
      fmt::format("isolcpus=managed_irq,domain,{0} nohz_full={0} rcu_nocbs={0} irqaffinity={1} preempt=full",
                  list, format_cpu_list(plan.housekeeping));
  if (facts.has_grub) {
    plan.files.push_back(
        {PlanPart::grub,
         with_head(fmt::format("# The entries for recovery boot without it.\n"
                               "GRUB_CMDLINE_LINUX_DEFAULT=\"$GRUB_CMDLINE_LINUX_DEFAULT {}\"\n",
                               plan.kernel_words))});
  }
  plan.files.push_back({PlanPart::sysctl, with_head(sysctl_text(plan))});
  plan.files.push_back({PlanPart::unit, with_head(unit_text(plan))});
  plan.files.push_back({PlanPart::unit_link, {}});
  plan.files.push_back(
      {PlanPart::irqbalance,
       with_head(fmt::format("[Service]\nEnvironment=IRQBALANCE_BANNED_CPULIST={}\n", list))});
  plan.files.push_back(
      {PlanPart::udev, with_head(fmt::format("ACTION==\"bind\", SUBSYSTEM==\"pci|platform|usb|virtio\", "
                                             "RUN+=\"/bin/systemctl --no-block try-restart {}\"\n",
                                             kPlanUnit))});
  return plan;
}

std::span<const Fix> host_fixes() noexcept {
  return kFixes;
}

namespace {

// As a shell reads a line that begins outside of quotes: a comment begins a word.
std::string_view without_comment(std::string_view line) {
  char quote = '\0';
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quote != '\0') {
      if (c == '\\' && quote == '"') {
        ++i;
      } else if (c == quote) {
        quote = '\0';
      }
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '#' && (i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t' || line[i - 1] == ';')) {
      return line.substr(0, i);
    }
  }
  return line;
}

}  // namespace

std::vector<std::string> words_that_clash(std::string_view file) {
  std::vector<std::string> found;
  std::istringstream lines{std::string(file)};
  for (std::string text; std::getline(lines, text);) {
    const std::string_view line = without_comment(text);
    for (const std::string_view word : kWordsOfPlan) {
      if (line.find(word) != std::string_view::npos) found.emplace_back(word);
    }
  }
  return found;
}

bool replaces_command_line(std::string_view file) {
  constexpr std::string_view kVariable = "GRUB_CMDLINE_LINUX_DEFAULT";
  std::istringstream lines{std::string(file)};
  for (std::string line; std::getline(lines, line);) {
    std::string_view rest = line;
    rest.remove_prefix(std::min(rest.find_first_not_of(" \t"), rest.size()));
    if (rest.starts_with("export ")) rest.remove_prefix(std::string_view("export ").size());
    if (!rest.starts_with(fmt::format("{}=", kVariable))) continue;
    const bool kept = rest.find(fmt::format("${}", kVariable)) != std::string_view::npos ||
                      rest.find(fmt::format("${{{}", kVariable)) != std::string_view::npos;
    if (!kept) return true;
  }
  return false;
}

}  // namespace plchost
