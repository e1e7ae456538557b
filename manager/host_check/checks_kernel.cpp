#include <algorithm>
#include <array>
#include <cstdio>

#include <fmt/format.h>

#include "manager/host_check/checks.hpp"
#include "shm/base/cpu_list.hpp"

namespace plchost::host_check {

namespace {

constexpr auto kPreemptionSubject = "pre-emption model";
constexpr auto kPreemptionWhy =
    "a task has to wait until the kernel can be interrupted: under full pre-emption for some 10 us, else for "
    "ms";

// "none voluntary (full) lazy": the one in parentheses.
std::string chosen(std::string_view text) {
  const std::size_t open = text.find('(');
  const std::size_t close = text.find(')', open);
  if (open == std::string_view::npos || close == std::string_view::npos) return {};
  return std::string(text.substr(open + 1, close - open - 1));
}

// Of a kernel that can choose at boot: where the choice can be read.
std::string dynamic_mode(const HostFiles& files) {
  if (const auto mode = files.text("/sys/kernel/debug/sched/preempt"); mode && !chosen(*mode).empty()) {
    return chosen(*mode);
  }
  if (const auto line = files.text("/proc/cmdline")) {
    if (std::string mode = boot_value(*line, "preempt"); !mode.empty()) return mode;
  }
  const auto release = files.text("/proc/sys/kernel/osrelease");
  const auto config = files.text("/boot/config-" + release.value_or(""));
  if (!config) return {};
  constexpr std::array kChoices = {
      std::pair{"CONFIG_PREEMPT=y", "full"}, std::pair{"CONFIG_PREEMPT_LAZY=y", "lazy"},
      std::pair{"CONFIG_PREEMPT_VOLUNTARY=y", "voluntary"}, std::pair{"CONFIG_PREEMPT_NONE=y", "none"}};
  for (const auto& [line, mode] : kChoices) {
    if (("\n" + *config + "\n").find(fmt::format("\n{}\n", line)) != std::string::npos) return mode;
  }
  return {};
}

HostFinding judge_preemption(const std::string& mode) {
  const std::string advice =
      "install a PREEMPT_RT kernel (Debian: linux-image-rt-amd64), or boot with preempt=full";
  const std::string found = fmt::format("{}, not PREEMPT_RT", mode);
  if (mode == "full" || mode == "lazy") {
    return finding(FindingLevel::note, kPreemptionSubject, found, kPreemptionWhy,
                   "install a PREEMPT_RT kernel (Debian: linux-image-rt-amd64)");
  }
  if (mode == "voluntary" || mode == "none") {
    return finding(FindingLevel::warning, kPreemptionSubject, found, kPreemptionWhy, advice);
  }
  return finding(FindingLevel::note, kPreemptionSubject,
                 fmt::format("not known: the kernel calls it '{}'", mode), kPreemptionWhy, advice);
}

// Since 6.12 starved programs are served by a deadline server, and nothing is throttled otherwise.
bool has_fair_server(const HostFiles& files) {
  const auto release = files.text("/proc/sys/kernel/osrelease");
  int major = 0;
  int minor = 0;
  if (!release || std::sscanf(release->c_str(), "%d.%d", &major, &minor) != 2)
    return false;  // NOLINT: bounded
  constexpr int kMajor = 6;
  constexpr int kMinor = 12;
  return major > kMajor || (major == kMajor && minor >= kMinor);
}

}  // namespace

HostFinding preemption(const CheckedHost& host) {
  const auto version = host.files.text("/proc/sys/kernel/version");
  const auto real_time = host.files.text("/sys/kernel/realtime");
  if ((real_time && *real_time == "1") || (version && version->find("PREEMPT_RT") != std::string::npos)) {
    return finding(FindingLevel::ok, kPreemptionSubject, "PREEMPT_RT", kPreemptionWhy);
  }
  if (!version) return unknown(kPreemptionSubject, version.error(), kPreemptionWhy);
  if (version->find("PREEMPT_DYNAMIC") != std::string::npos) {
    const std::string mode = dynamic_mode(host.files);
    if (!mode.empty()) return judge_preemption(mode);
    return finding(
        FindingLevel::note, kPreemptionSubject,
        "chosen at boot (PREEMPT_DYNAMIC), which one is not known: neither /sys/kernel/debug/sched/preempt "
        "nor preempt= in /proc/cmdline nor a file /boot/config-* says it",
        kPreemptionWhy,
        "look with: zgrep PREEMPT /proc/config.gz; boot with preempt=full, or use PREEMPT_RT");
  }
  const bool full = (" " + *version + " ").find(" PREEMPT ") != std::string::npos;
  return judge_preemption(full ? "full" : "none");
}

HostFinding throttling(const CheckedHost& host) {
  constexpr auto kSubject = "kernel.sched_rt_runtime_us";
  constexpr auto kWhy =
      "SCHED_FIFO tasks that use more than this share of a core are stopped for the rest of the period";
  const auto run_time = host.files.number("/proc/sys/kernel/sched_rt_runtime_us");
  const auto period = host.files.number("/proc/sys/kernel/sched_rt_period_us");
  if (!run_time) return unknown(kSubject, run_time.error(), kWhy);
  if (!period) return unknown(kSubject, period.error(), kWhy);
  const std::string found = fmt::format("{} of {} us", *run_time, *period);
  if (*run_time == 0) {
    return finding(FindingLevel::problem, kSubject, found, kWhy,
                   "sysctl -w kernel.sched_rt_runtime_us=950000");
  }
  if (*run_time < 0) return finding(FindingLevel::ok, kSubject, "-1: never stopped", kWhy);
  if (*run_time >= *period) return finding(FindingLevel::ok, kSubject, found + ": never stopped", kWhy);
  const auto quiet = isolated(host.files);
  const auto cores = plc_cores(host);
  constexpr std::int64_t kAll = 100;
  constexpr std::int64_t kUsual = 95;  // percent: a kernel begins with it
  const bool usual = *run_time >= *period / kAll * kUsual;
  if (usual && quiet && !cores.empty() && cores_without(cores, *quiet).empty()) {
    // There -1 has little to give, and it would stop the kernel's own threads beside a task that never ends.
    return finding(FindingLevel::ok, kSubject, found + ", on isolated cores: more only with a load above it",
                   kWhy, "keep the load of each core below it");
  }
  return finding(
      FindingLevel::note, kSubject, found,
      has_fair_server(host.files) ? "above this load other programs that starve take 50 ms of each second "
                                    "(since Linux 6.12), and a task waits so long"
                                  : kWhy,
      "keep the load of each core below it; or sysctl -w kernel.sched_rt_runtime_us=-1, only when every "
      "program is known to leave time to others");
}

HostFinding timer_slack(const CheckedHost& host) {
  constexpr auto kSubject = "timer slack";
  constexpr auto kWhy = "threads that are not SCHED_FIFO wake up as much later, 50 us by default";
  const auto slack = host.files.number("/proc/self/timerslack_ns");
  if (!slack) return unknown(kSubject, slack.error(), kWhy);
  return finding(FindingLevel::ok, kSubject,
                 fmt::format("{} ns for the manager; each instance sets its own to 1 ns", *slack), kWhy);
}

HostFinding timer_migration(const CheckedHost& host) {
  constexpr auto kSubject = "kernel.timer_migration";
  constexpr auto kWhy =
      "timers of sleeping cores move to one that is awake, and may so interrupt an instance's core";
  if (auto off = unless_on(host.files, "/proc/sys/kernel/timer_migration", kSubject, kWhy))
    return *std::move(off);
  const auto no_tick = host.files.cores("/sys/devices/system/cpu/nohz_full");
  const auto cores = plc_cores(host);
  if (no_tick && !cores.empty() && cores_without(cores, *no_tick).empty()) {
    return finding(FindingLevel::ok, kSubject, "on, but not to cores of nohz_full", kWhy);
  }
  return finding(FindingLevel::note, kSubject, "on", kWhy, "sysctl -w kernel.timer_migration=0");
}

HostFinding clock_source(const CheckedHost& host) {
  constexpr auto kSubject = "clock source";
  constexpr auto kWhy =
      "a clock that is not a register of the processor costs a system call, some us, at each reading";
  constexpr std::array kFast = {std::string_view("tsc"), std::string_view("arch_sys_counter"),
                                std::string_view("riscv_clocksource"), std::string_view("timebase")};
  const auto source = host.files.text("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  if (!source) return unknown(kSubject, source.error(), kWhy);
  if (std::ranges::find(kFast, *source) != kFast.end())
    return finding(FindingLevel::ok, kSubject, *source, kWhy);
  if (*source == "kvm-clock" || source->starts_with("hyperv_clocksource")) {
    return finding(FindingLevel::note, kSubject,
                   fmt::format("{}: read without a system call, corrected by the hypervisor", *source), kWhy,
                   "boot with clocksource=tsc if the hypervisor offers an invariant tsc");
  }
  return finding(
      FindingLevel::warning, kSubject, *source, kWhy,
      "see in the kernel's log why tsc was given up; boot with tsc=reliable where it is known to be good");
}

HostFinding watchdog(const CheckedHost& host) {
  constexpr auto kSubject = "lock-up watchdog";
  constexpr auto kWhy =
      "it interrupts each of its cores every 4 s, with nmi_watchdog at moments that nothing can mask";
  if (auto off = unless_on(host.files, "/proc/sys/kernel/watchdog", kSubject, kWhy)) return *std::move(off);
  const auto watched = host.files.cores("/proc/sys/kernel/watchdog_cpumask");
  if (!watched) return unknown(kSubject, watched.error(), kWhy);
  const auto hit = common_cores(plc_cores(host), *watched);
  if (hit.empty()) return finding(FindingLevel::ok, kSubject, "on, and on no instance's core", kWhy);
  const auto online = host.files.cores("/sys/devices/system/cpu/online");
  const auto rest = cores_without(online.value_or(*watched), plc_cores(host));
  const auto by_nmi = host.files.number("/proc/sys/kernel/nmi_watchdog");
  return finding(FindingLevel::note, name_cores(host, hit),
                 fmt::format("watched{}", by_nmi && *by_nmi == 1 ? ", by NMI too" : ""), kWhy,
                 rest.empty() ? "sysctl -w kernel.watchdog=0"
                              : fmt::format("sysctl -w kernel.watchdog_cpumask={}", format_cpu_list(rest)));
}

}  // namespace plchost::host_check
