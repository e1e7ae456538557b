#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "manager/host_check/checks.hpp"
#include "shm/base/cpu_list.hpp"

namespace plchost::host_check {

namespace {

constexpr auto kNoInstance = "no instance has a core";

// The finding for cores that some set of the kernel should have: those that it lacks.
HostFinding judge(const CheckedHost& host, const std::vector<int>& has, FindingLevel level, const char* what,
                  const char* why, const std::string& advice) {
  const auto cores = plc_cores(host);
  const auto missing = cores_without(cores, has);
  if (cores.empty()) return finding(FindingLevel::ok, what, kNoInstance, why);
  if (missing.empty()) return finding(FindingLevel::ok, name_cores(host, cores), what, why);
  return finding(level, name_cores(host, missing), fmt::format("not {}", what), why, advice);
}

}  // namespace

HostFinding isolated_cores(const CheckedHost& host) {
  constexpr auto kWhat = "isolated";
  constexpr auto kWhy =
      "any program may be put there; it fills the caches and keeps the kernel busy, which delays "
      "cycles";
  const auto cores = isolated(host.files);
  if (!cores) return unknown("isolated cores", cores.error(), kWhy);
  return judge(host, *cores, FindingLevel::warning, kWhat, kWhy,
               fmt::format("boot with isolcpus=managed_irq,domain,{}", format_cpu_list(plc_cores(host))));
}

HostFinding tick(const CheckedHost& host) {
  const std::string path = "/sys/devices/system/cpu/nohz_full";
  constexpr auto kWhat = "free of the kernel's tick (nohz_full)";
  constexpr auto kWhy = "the tick interrupts a running task 100 to 1000 times a second, for some us each";
  if (host.files.kernel_lacks(path)) {
    return finding(FindingLevel::note, kWhat, "the kernel cannot do it", kWhy,
                   "use a kernel with CONFIG_NO_HZ_FULL where cycles are long");
  }
  const auto cores = host.files.cores(path);
  if (!cores) return unknown(kWhat, cores.error(), kWhy);
  return judge(host, *cores, FindingLevel::note, kWhat, kWhy,
               fmt::format("boot with nohz_full={}", format_cpu_list(plc_cores(host))));
}

HostFinding rcu_callbacks(const CheckedHost& host) {
  constexpr auto kWhat = "free of RCU callbacks (rcu_nocbs)";
  constexpr auto kWhy = "the kernel runs the clean-up of other programs' work there, in bursts";
  const auto line = host.files.text("/proc/cmdline");
  if (!line) return unknown(kWhat, line.error(), kWhy);
  std::vector<int> cores;
  for (const char* key : {"rcu_nocbs", "nohz_full"}) {  // the second implies the first
    const std::string value = boot_value(*line, key);
    if (value == "all") return finding(FindingLevel::ok, name_cores(host, plc_cores(host)), kWhat, kWhy);
    auto list = parse_cpu_list(value);
    if (!list) {
      const Error error{ErrorCode::corrupt, 0, fmt::format("'{}={}' in /proc/cmdline", key, value)};
      return unknown(kWhat, error, kWhy);
    }
    cores.insert(cores.end(), list->begin(), list->end());
  }
  std::ranges::sort(cores);
  return judge(host, cores, FindingLevel::note, kWhat, kWhy,
               fmt::format("boot with rcu_nocbs={}", format_cpu_list(plc_cores(host))));
}

HostFinding siblings(const CheckedHost& host) {
  constexpr auto kSubject = "hyper-thread siblings";
  constexpr auto kWhy =
      "both share one core's arithmetic units and caches: each program on one slows the other down";
  constexpr std::size_t kPairsShown = 3;
  const auto cores = plc_cores(host);
  const auto quiet = isolated(host.files);
  const auto online = host.files.cores("/sys/devices/system/cpu/online");
  std::vector<std::string> busy;
  std::vector<int> victims;
  for (const int core : cores) {
    const auto together =
        host.files.cores(fmt::format("/sys/devices/system/cpu/cpu{}/topology/thread_siblings_list", core));
    if (!together) return unknown(name_cores(host, {core}), together.error(), kWhy);
    for (const int sibling : cores_without(*together, {core})) {
      const bool plc = std::ranges::binary_search(cores, sibling);
      const bool off = online && !std::ranges::binary_search(*online, sibling);
      const bool left_alone = quiet && std::ranges::binary_search(*quiet, sibling);
      if (off || (left_alone && !plc)) continue;
      if (plc && sibling < core) continue;  // said already, from the other side
      victims.push_back(core);
      busy.push_back(fmt::format("core {} is one with {}{}", core, name_cores(host, {sibling}),
                                 plc ? "" : ", which works for all programs"));
    }
  }
  if (victims.empty()) {
    return finding(FindingLevel::ok, kSubject,
                   cores.empty() ? kNoInstance : "none of an instance's core is in use", kWhy);
  }
  victims.erase(std::ranges::unique(victims).begin(), victims.end());
  return finding(
      FindingLevel::warning, name_cores(host, victims), join_some(busy, "; ", kPairsShown), kWhy,
      "leave the sibling idle: isolate it too, echo 0 > /sys/devices/system/cpu/cpuN/online, or boot with "
      "nosmt; give two instances cores of their own");
}

HostFinding housekeeping(const CheckedHost& host) {
  constexpr auto kSubject = "housekeeping core";
  constexpr auto kWhy =
      "the kernel's own work, interrupts, the manager and the API server need a core; the kernel keeps "
      "time on core 0";
  const auto online = host.files.cores("/sys/devices/system/cpu/online");
  if (!online) return unknown(kSubject, online.error(), kWhy);
  const auto cores = plc_cores(host);
  const auto rest = cores_without(*online, cores);
  if (rest.empty()) {
    return finding(FindingLevel::warning, name_cores(host, cores),
                   "every core on line belongs to an instance", kWhy, "leave core 0 free of instances");
  }
  if (std::ranges::binary_search(cores, 0)) {
    return finding(FindingLevel::warning, name_cores(host, {0}),
                   "an instance has the core that the kernel itself uses", kWhy,
                   fmt::format("give the instance another core; {} has none", format_cpu_list(rest)));
  }
  return finding(FindingLevel::ok, kSubject, format_cpu_list(rest), kWhy);
}

HostFinding shared_cores(const CheckedHost& host) {
  constexpr auto kWhy = "their tasks delay each other, by priority band and priority";
  std::map<int, int> count;
  for (const CheckedHost::Instance& instance : host.instances) ++count[instance.core];
  std::vector<int> shared;
  for (const auto& [core, instances] : count) {
    if (instances > 1) shared.push_back(core);
  }
  if (shared.empty()) return finding(FindingLevel::ok, "shared cores", "none", kWhy);
  return finding(FindingLevel::note, name_cores(host, shared), "several instances on one core", kWhy,
                 "give each instance a core of its own");
}

HostFinding workqueues(const CheckedHost& host) {
  constexpr auto kSubject = "work queues of the kernel";
  constexpr auto kWhy = "their threads do the kernel's deferred work on any of these cores";
  const std::string path = "/sys/devices/virtual/workqueue/cpumask";
  const auto mask = host.files.core_mask(path);
  if (!mask) return unknown(kSubject, mask.error(), kWhy);
  const auto hit = common_cores(plc_cores(host), *mask);
  if (hit.empty())
    return finding(FindingLevel::ok, kSubject, fmt::format("on core {} only", format_cpu_list(*mask)), kWhy);
  return finding(FindingLevel::note, name_cores(host, hit), fmt::format("in {}", path), kWhy,
                 fmt::format("write the mask of the housekeeping cores to {}, or boot with isolcpus=", path));
}

}  // namespace plchost::host_check
