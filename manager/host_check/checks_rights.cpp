#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>

#include <fmt/format.h>
#include <linux/capability.h>

#include "manager/host_check/checks.hpp"
#include "shm/base/cpu_list.hpp"

namespace plchost::host_check {

namespace {

// The highest that an instance uses: the supervision of the high band.
constexpr int kHighestPriority = 89;

constexpr std::string_view kRights =
    "give the manager CAP_SYS_NICE, or LimitRTPRIO=99 (ulimit -r 99): plchostd.service has both";

// The first of these files that there is, from the own control group upwards.
std::string group_file(const HostFiles& files, std::string_view controller,
                       std::initializer_list<std::string_view> names) {
  for (const std::string& folder : group_folders(files, controller)) {
    for (const std::string_view name : names) {
      if (const std::string path = fmt::format("{}/{}", folder, name); files.exists(path)) return path;
    }
  }
  return {};
}

int to_int(std::string_view digits) {
  int number = 0;
  const auto [stopped, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return error == std::errc::result_out_of_range ? kHighestPriority : number;
}

}  // namespace

HostFinding real_time_class(const CheckedHost& host) {
  constexpr auto kWhy =
      "without SCHED_FIFO no task of priority 0 to 15 can start, and any other program could delay it by ms";
  const std::string file = group_file(host.files, "cpu", {"cpu.rt_runtime_us"});
  const int error = host.try_fifo();
  if (error == 0) return finding(FindingLevel::ok, "SCHED_FIFO", "granted", kWhy);
  const auto run_time = file.empty() ? Result<std::int64_t>(0) : host.files.number(file);
  if (!file.empty() && run_time && *run_time == 0) {
    return finding(
        FindingLevel::problem, "SCHED_FIFO",
        fmt::format("refused: {}; the control group has no real-time run time: {} is 0", std::strerror(error),
                    file),
        kWhy,
        fmt::format(
            "echo 950000 > {} (first in the groups above it), or start the manager in a group that has "
            "some, or boot with rt_group_sched=0",
            file));
  }
  const auto nice = has_capability(host.files, CAP_SYS_NICE);
  const bool right = nice && *nice;
  return finding(
      FindingLevel::problem, "SCHED_FIFO", fmt::format("refused: {}", std::strerror(error)), kWhy,
      right ? "the right is there (CAP_SYS_NICE): look for a control group without real-time run time, a "
              "seccomp filter, or RestrictRealtime=yes in the unit file"
            : std::string(kRights));
}

HostFinding priority_limit(const CheckedHost& host) {
  constexpr auto kSubject = "real-time priority";
  const std::string why = fmt::format(
      "instances use SCHED_FIFO priorities up to {}; a start above the limit fails", kHighestPriority);
  const auto nice = has_capability(host.files, CAP_SYS_NICE);
  if (nice && *nice) return finding(FindingLevel::ok, kSubject, "any (CAP_SYS_NICE)", why);
  const auto limit = soft_limit(host.files, "Max realtime priority");
  if (!nice) return unknown(kSubject, nice.error(), why);
  if (!limit) return unknown(kSubject, limit.error(), why);
  const bool enough = *limit == "unlimited" || to_int(*limit) >= kHighestPriority;
  return finding(enough ? FindingLevel::ok : FindingLevel::problem, kSubject,
                 fmt::format("limit {}, no CAP_SYS_NICE", *limit), why,
                 enough ? std::string() : std::string(kRights));
}

HostFinding memory_lock(const CheckedHost& host) {
  constexpr auto kSubject = "locked memory";
  constexpr auto kWhy =
      "a page that is not in memory delays the cycle that touches it, by ms when it comes from a disk";
  const auto lock = has_capability(host.files, CAP_IPC_LOCK);
  if (lock && *lock) return finding(FindingLevel::ok, kSubject, "any amount (CAP_IPC_LOCK)", kWhy);
  const auto limit = soft_limit(host.files, "Max locked memory");
  if (!lock) return unknown(kSubject, lock.error(), kWhy);
  if (!limit) return unknown(kSubject, limit.error(), kWhy);
  if (*limit == "unlimited") return finding(FindingLevel::ok, kSubject, "unlimited", kWhy);
  return finding(
      FindingLevel::warning, kSubject,
      fmt::format("limit {} bytes, no CAP_IPC_LOCK: instances run without locked memory", *limit), kWhy,
      "give the manager CAP_IPC_LOCK, or LimitMEMLOCK=infinity (ulimit -l unlimited): plchostd.service has "
      "both");
}

HostFinding allowed_cores(const CheckedHost& host) {
  constexpr auto kSubject = "cores that may be used";
  constexpr auto kWhy = "an instance that cannot be bound to its core is not started";
  const std::string file =
      group_file(host.files, "cpuset", {"cpuset.cpus.effective", "cpuset.effective_cpus", "cpuset.cpus"});
  const std::string online = "/sys/devices/system/cpu/online";
  const auto allowed = host.files.cores(file.empty() ? online : file);
  if (!allowed) return unknown(kSubject, allowed.error(), kWhy);
  const auto missing = cores_without(plc_cores(host), *allowed);
  if (missing.empty()) {
    return finding(FindingLevel::ok, kSubject,
                   fmt::format("{} ({})", format_cpu_list(*allowed), file.empty() ? online : file), kWhy);
  }
  return finding(
      FindingLevel::problem, name_cores(host, missing),
      fmt::format("not among {}, the cores in {}", format_cpu_list(*allowed), file.empty() ? online : file),
      kWhy,
      "let the control group have the core (AllowedCPUs= in the unit file), or give the instance another");
}

HostFinding cpu_quota(const CheckedHost& host) {
  constexpr auto kSubject = "CPU quota";
  constexpr auto kWhy =
      "a group that has used up its share stands still for the rest of its period: tasks of priority 16 to "
      "31, the "
      "manager, the API server";
  const auto folders = group_folders(host.files, "cpu");
  for (const std::string& folder : folders) {
    for (const char* name : {"cpu.max", "cpu.cfs_quota_us"}) {
      const std::string path = fmt::format("{}/{}", folder, name);
      if (!host.files.exists(path)) continue;
      const auto quota = host.files.text(path);
      if (!quota) return unknown(kSubject, quota.error(), kWhy);
      if (quota->starts_with("max") || quota->starts_with("-1")) continue;
      return finding(
          FindingLevel::warning, kSubject, fmt::format("{} is '{}'", path, *quota), kWhy,
          "take the quota away: CPUQuota= without a value in the unit file and in the slices above it");
    }
  }
  if (folders.empty()) {
    const Error nothing{ErrorCode::not_found, 0, "no control groups of the CPU are to be seen"};
    return unknown(kSubject, nothing, kWhy);
  }
  return finding(FindingLevel::ok, kSubject, "none", kWhy);
}

HostFinding instance_limits(const CheckedHost& host) {
  constexpr auto kSubject = "control groups of instances";
  constexpr auto kWhy =
      "an application that takes all memory or all threads takes them from the other instances, too; "
      "processes that it has forked can outlive it";
  constexpr auto kAdvice =
      "start the manager by plchostd.service with plchost-instances.service, or give it a folder of control "
      "groups by [host] instance_groups; boot without cgroup_disable=memory";
  const auto lacks = [&](std::string_view controller) {
    const auto& missing = host.groups.missing;
    return !host.groups.problem.empty() ||
           std::ranges::any_of(missing, [&](const auto& one) { return one.first == controller; });
  };
  std::string found = host.groups.problem.empty() ? host.groups.folder : "none: " + host.groups.problem;
  for (const auto& [controller, why] : host.groups.missing)
    found += fmt::format("; without {}: {}", controller, why);
  std::vector<std::string> limits;
  for (const CheckedHost::Instance& instance : host.instances) {
    if (instance.memory_limited && lacks("memory")) limits.push_back("memory_max_mib of " + instance.name);
    if (instance.pids_limited && lacks("pids")) limits.push_back("pids_max of " + instance.name);
  }
  constexpr std::size_t kNamed = 4;
  if (!limits.empty()) {
    return finding(FindingLevel::warning, kSubject,
                   fmt::format("{}; these limits do not hold: {}", found, join_some(limits, ", ", kNamed)),
                   kWhy, kAdvice);
  }
  const bool all = !lacks("memory") && !lacks("pids");
  return finding(all ? FindingLevel::ok : FindingLevel::note, kSubject, found, kWhy, all ? "" : kAdvice);
}

}  // namespace plchost::host_check
