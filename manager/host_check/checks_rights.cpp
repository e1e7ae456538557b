#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <initializer_list>
#include <iterator>
#include <map>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <linux/capability.h>

#include "manager/host_check/checks.hpp"
#include "manager/system/control_groups.hpp"
#include "shm/base/cpu_list.hpp"

namespace plchost::host_check {

namespace {

// The highest that an instance uses: the supervision of the high band.
constexpr int kHighestPriority = 89;

constexpr std::string_view kRights =
    "give the manager CAP_SYS_NICE, or LimitRTPRIO=99 (ulimit -r 99): plchostd.service has both";

constexpr std::size_t kNamed = 4;  // of several things

// The first of these files that there is.
std::string first_file(const HostFiles& files, const std::vector<std::string>& folders,
                       std::initializer_list<std::string_view> names) {
  for (const std::string& folder : folders) {
    for (const std::string_view name : names) {
      if (const std::string path = fmt::format("{}/{}", folder, name); files.exists(path)) return path;
    }
  }
  return {};
}

// The file with the cores of the first of these groups that has one, else with those on line.
std::string cores_file(const HostFiles& files, const std::vector<std::string>& folders) {
  const std::string file =
      first_file(files, folders, {"cpuset.cpus.effective", "cpuset.effective_cpus", "cpuset.cpus"});
  return file.empty() ? "/sys/devices/system/cpu/online" : file;
}

// A limit of the kernel that is not the one of the configuration. A controller that is not there has no file.
std::string other_limit(const HostFiles& files, const std::string& file, std::uint64_t wanted) {
  const auto value = files.text(file);
  const std::string text = wanted == 0 ? "max" : fmt::format("{}", wanted);
  if (!value || *value == text) return {};
  return fmt::format("{} is {}, not {}", file.substr(file.rfind('/') + 1), *value, text);
}

// Of an instance that runs: how its limits differ from those of the configuration.
std::string other_limits(const CheckedHost& host, const CheckedHost::Instance& instance) {
  if (instance.pid == 0) return {};
  const std::string group = fmt::format("{}/{}", host.groups.folder, instance.group);
  std::istringstream processes{host.files.text(group + "/cgroup.procs").value_or("")};
  const bool inside = std::find(std::istream_iterator<int>(processes), std::istream_iterator<int>(),
                                instance.pid) != std::istream_iterator<int>();
  if (!inside) {
    const auto place =
        group_place(host.files.text(fmt::format("/proc/{}/cgroup", instance.pid)).value_or(""), "");
    return fmt::format("{} is in {} without limits of its own", instance.name,
                       place ? place->path : "another group");
  }
  std::vector<std::string> differences;
  for (const auto& [file, wanted] :
       {std::pair("memory.max", instance.memory_max), std::pair("pids.max", instance.pids_max)}) {
    if (auto text = other_limit(host.files, fmt::format("{}/{}", group, file), wanted); !text.empty())
      differences.push_back(std::move(text));
  }
  if (differences.empty()) return {};
  return fmt::format("{}: {}", instance.name, fmt::join(differences, ", "));
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
  const std::string file = first_file(host.files, group_folders(host.files, "cpu"), {"cpu.rt_runtime_us"});
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
  std::map<std::string, std::vector<int>> files;  // those that count, with the cores of their instances
  for (const CheckedHost::Instance& instance : host.instances)
    files[cores_file(host.files, group_folders_of(host, instance, "cpuset"))].push_back(instance.core);
  if (files.empty()) files[cores_file(host.files, group_folders(host.files, "cpuset"))];
  std::vector<std::string> good;
  std::vector<std::string> bad;
  std::vector<int> missing;
  for (auto& [file, cores] : files) {
    const auto allowed = host.files.cores(file);
    if (!allowed) return unknown(kSubject, allowed.error(), kWhy);
    const auto lacking = cores_without(each_once(std::move(cores)), *allowed);
    const std::string list = format_cpu_list(*allowed);
    good.push_back(fmt::format("{} ({})", list, file));
    if (!lacking.empty()) bad.push_back(fmt::format("not among {}, the cores in {}", list, file));
    missing.insert(missing.end(), lacking.begin(), lacking.end());
  }
  if (missing.empty()) return finding(FindingLevel::ok, kSubject, join_some(good, "; ", kNamed), kWhy);
  return finding(
      FindingLevel::problem, name_cores(host, each_once(std::move(missing))), join_some(bad, "; ", kNamed),
      kWhy,
      "let the control group of the instances have the core (AllowedCPUs= of plchost-instances.service and "
      "the slices above it), or give the instance another");
}

HostFinding cpu_quota(const CheckedHost& host) {
  constexpr auto kSubject = "CPU quota";
  constexpr auto kWhy =
      "a group that has used up its share stands still for the rest of its period: tasks of priority 16 to "
      "31, the "
      "manager, the API server";
  auto folders = group_folders(host.files, "cpu");
  for (const CheckedHost::Instance& instance : host.instances)
    std::ranges::copy(group_folders_of(host, instance, "cpu"), std::back_inserter(folders));
  for (const std::string& folder : folders) {
    for (const char* name : {"cpu.max", "cpu.cfs_quota_us"}) {
      const std::string path = fmt::format("{}/{}", folder, name);
      if (!host.files.exists(path)) continue;
      const auto quota = host.files.text(path);
      if (!quota) return unknown(kSubject, quota.error(), kWhy);
      if (quota->starts_with("max") || quota->starts_with("-1")) continue;
      return finding(FindingLevel::warning, kSubject, fmt::format("{} is '{}'", path, *quota), kWhy,
                     "take the quota away: CPUQuota= without a value in the unit file of that group and in "
                     "the slices above it");
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
  constexpr auto kRestart =
      "restart these instances: their next processes have the limits of the configuration";
  const auto lacks = [&](std::string_view controller) {
    const auto& missing = host.groups.missing;
    return !host.groups.problem.empty() ||
           std::ranges::any_of(missing, [&](const auto& one) { return one.first == controller; });
  };
  std::string found = host.groups.problem.empty() ? host.groups.folder : "none: " + host.groups.problem;
  for (const auto& [controller, why] : host.groups.missing)
    found += fmt::format("; without {}: {}", controller, why);
  std::vector<std::string> limits;   // that can hold for no process
  std::vector<std::string> running;  // differences of processes that run
  bool unlimited = false;            // one of these has a limit in the configuration
  for (const CheckedHost::Instance& instance : host.instances) {
    if (instance.memory_max != 0 && lacks("memory")) limits.push_back("memory_max_mib of " + instance.name);
    if (instance.pids_max != 0 && lacks("pids")) limits.push_back("pids_max of " + instance.name);
    const std::string differs = host.groups.problem.empty() ? other_limits(host, instance) : "";
    if (differs.empty()) continue;
    running.push_back(differs);
    unlimited = unlimited || instance.memory_max != 0 || instance.pids_max != 0;
  }
  if (!limits.empty()) found += "; these limits do not hold: " + join_some(limits, ", ", kNamed);
  if (!running.empty()) found += "; " + join_some(running, "; ", kNamed);
  const bool all = !lacks("memory") && !lacks("pids");
  auto level = all && running.empty() ? FindingLevel::ok : FindingLevel::note;
  if (!limits.empty() || unlimited) level = FindingLevel::warning;
  std::string advice = all ? "" : kAdvice;
  if (!running.empty()) advice += fmt::format("{}{}", advice.empty() ? "" : "; ", kRestart);
  return finding(level, kSubject, found, kWhy, advice);
}

}  // namespace plchost::host_check
